"""rl-zoo3 trains, evaluates and films an agent; it imports a module `custom_envs` from the working directory."""

import subprocess
import sys
import tempfile
from pathlib import Path

HYPERPARAMETERS = """
FixationPickZFC-v0:
  n_timesteps: 64
  policy: MultiInputPolicy
  n_steps: 32
  batch_size: 32
"""
TASK = ["--algo", "ppo", "--env", "FixationPickZFC-v0", "--env-kwargs", "image_size:(64,80)"]


def zoo(module, *arguments, folder):
    subprocess.run([sys.executable, "-m", f"rl_zoo3.{module}", *TASK, *arguments], cwd=folder, check=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "custom_envs.py").write_text("import fixation_gym\n")
        Path(folder, "ppo.yml").write_text(HYPERPARAMETERS)
        zoo("train", "--conf-file", "ppo.yml", "--eval-freq", "-1", folder=folder)
        zoo("enjoy", "-f", "logs", "-n", "10", "--no-render", folder=folder)
        zoo("record_video", "-f", "logs", "-n", "10", folder=folder)
        assert list(Path(folder).rglob("*.mp4"))
