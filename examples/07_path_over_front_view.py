"""The camera's path over the front view, as in the paper's Fig. 5: around the mirror and what came into view then."""

import sys
from pathlib import Path
from typing import Any

import cv2
import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401
from fixation_policies.catalogue import make_policy

COLOURS = {"search": (160, 160, 160), "fixate": (60, 140, 255), "approach": (40, 200, 80), "grasp": (240, 90, 40)}
ENLARGED = 2


def front_pixels(env: Any, points: np.ndarray) -> np.ndarray:
    """Pixels of the front view that show points, shape (n, 3), in base, m; shape (n, 2), px."""
    model, data, (height, width, _) = env.model, env.data, env.render().shape
    camera = model.camera("front").id
    offset = points + data.body("robot0_link0").xpos - data.cam_xpos[camera]
    x, y, z = (offset @ data.cam_xmat[camera].reshape(3, 3)).T  # x right, y up, z backwards
    focal = 0.5 * height / np.tan(0.5 * np.radians(model.cam_fovy[camera]))
    return np.stack([0.5 * width - focal * x / z, 0.5 * height + focal * y / z], axis=-1)


def draw_path(picture: np.ndarray, pixels: np.ndarray, phases: list[str], target: np.ndarray) -> np.ndarray:
    """The picture, enlarged, with path and, once a second, the line of sight to the target."""
    drawn = np.asarray(cv2.resize(picture, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC))
    pixels, target = (ENLARGED * pixels).astype(int), (ENLARGED * target).astype(int)
    for pixel in pixels[::25]:
        cv2.line(drawn, pixel.tolist(), target.tolist(), (235, 235, 235), 1, cv2.LINE_AA)
    for start, end, phase in zip(pixels[:-1], pixels[1:], phases, strict=False):
        cv2.line(drawn, start.tolist(), end.tolist(), COLOURS.get(phase, COLOURS["grasp"]), 3, cv2.LINE_AA)
    return drawn


def main(path: str = "path.jpg", scenario: str = "discovery", seed: int = 2) -> bool:
    """Run one episode of the servo and write the picture; returns whether the object was lifted."""
    if Path(path).suffix not in (".jpg", ".png") or not Path(path).absolute().parent.is_dir():
        raise SystemExit(f"{path} cannot be written; give the name of a .jpg or .png file in a folder that exists")
    env: Any = gym.make("FixationPick-v0", scenario=scenario, render_mode="rgb_array").unwrapped
    policy: Any = make_policy("servo", env)
    (obs, info), done = env.reset(seed=seed), False
    first, cameras, phases = env.render(), [], []
    target = front_pixels(env, env.sim.body_position("target")[None])[0]
    while not done and len(phases) < 25 * 25:
        cameras.append(obs["camera_pose"][:3])
        obs, _, done, _, info = env.step(policy.act(obs))
        phases.append(str(policy.estimate.phase))
    pixels = front_pixels(env, np.array(cameras))
    env.close()
    cv2.imwrite(path, cv2.cvtColor(draw_path(first, pixels, phases, target), cv2.COLOR_RGB2BGR))
    return info["is_success"]


if __name__ == "__main__":
    print("lifted" if main(sys.argv[1] if len(sys.argv) > 1 else "path.jpg") else "not lifted")
