"""LeRobot: its programs train ACT and a diffusion policy on exported picks, and evaluate one in the environment."""

import subprocess
import sys
import tempfile
from pathlib import Path

BIN = Path(sys.executable).parent
SIZE = (96, 128)
DATASET = ["--dataset.repo_id=fixation/picks", "--dataset.video_backend=pyav"]  # torchcodec wants FFmpeg's libraries
TRAINING = ["--policy.device=cpu", "--policy.push_to_hub=false", "--batch_size=2", "--steps=2", "--num_workers=0"]
ACT = ["--policy.type=act", "--policy.pretrained_backbone_weights=null", "--policy.dim_model=64", "--policy.n_heads=2"]
# It takes pictures of one size only: not the map beside the wrist's.
INPUTS = (
    '{"observation.state": {"type": "STATE", "shape": [8]},'
    ' "observation.images.wrist": {"type": "VISUAL", "shape": [3, 96, 128]}}'
)
DIFFUSION = ["--policy.type=diffusion", f"--policy.input_features={INPUTS}", "--policy.crop_shape=[84,112]"]
DIFFUSION += ["--policy.pretrained_backbone_weights=null"]
ENVIRONMENT = ["--env.discover_packages_path=fixation_gym.lerobot_env", "--env.type=fixation"]
ENVIRONMENT += [f"--env.observation_height={SIZE[0]}", f"--env.observation_width={SIZE[1]}", "--env.episode_length=15"]


def run(program, *arguments):
    subprocess.run([program, *arguments], check=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        picks = ["--policy", "servo", "--scenario", "clear", "--episodes", "1", "--image-size", *map(str, SIZE)]
        run(sys.executable, "-m", "fixation_gym", "export", *picks, "--out", f"{folder}/picks")
        dataset = [*DATASET, f"--dataset.root={folder}/picks"]
        for name, policy in (("act", ACT), ("diffusion", DIFFUSION)):
            run(BIN / "lerobot-train", *dataset, *TRAINING, *policy, f"--output_dir={folder}/{name}")
        model = f"--policy.path={folder}/act/checkpoints/last/pretrained_model"
        episodes = ["--policy.device=cpu", "--eval.n_episodes=2", "--eval.batch_size=2", f"--output_dir={folder}/eval"]
        run(BIN / "lerobot-eval", model, *ENVIRONMENT, *episodes)
        assert len(list(Path(folder, "eval", "videos", "fixation_0").glob("*.mp4"))) == 2
