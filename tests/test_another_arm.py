"""Another arm is one value: a UR5e with the Panda's fingers and another camera picks as the Panda does."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

PICK = """
import math
from dataclasses import replace
import fixation_gym.robots as robots

panda = robots.PANDA
robots.ROBOT = replace(
    panda,
    camera=replace(panda.camera, fovy=math.radians(50.0), in_hand=(0.075, 0.0, 0.03)),
    arm=replace(panda.arm, posture=(-0.47, -1.74, 2.48, -2.28, -1.59, -1.99), joint_speeds=(3.0,) * 6),
    simulated=robots.Simulated("UR5e", "PandaGripper", "base", "shoulder_link"),
)
import gymnasium
from fixation_gym.evaluation.rollout import run_episode
from fixation_policies.catalogue import make_policy

env = gymnasium.make("FixationPick-v0", scenario="clear")
result = run_episode(env, make_policy("servo", env), seed=3)
print(result.success, result.collision, env.observation_space["joint_pos"].shape, env.unwrapped.hand_eye[:3, 3])
env.close()
"""


@pytest.mark.sim
def test_the_servo_picks_with_another_arm():
    result = subprocess.run([sys.executable, "-c", PICK], capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-1] == "True False (6,) [0.075 0.    0.03 ]"
