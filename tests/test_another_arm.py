"""Another arm is one value: the UR5e of docs/doors/robot.md picks as the Panda does."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

PAGE = (ROOT / "docs" / "doors" / "robot.md").read_text()
PICK = (
    re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1]
    + """
import gymnasium
from fixation_gym.evaluation.rollout import run_episode
from fixation_policies.catalogue import make_policy

env = gymnasium.make("FixationPick-v0", scenario="clear")
result = run_episode(env, make_policy("servo", env), seed=3)
print(result.success, result.collision, env.observation_space["joint_pos"].shape, env.unwrapped.hand_eye[:3, 3])
env.close()
"""
)


@pytest.mark.sim
def test_the_servo_picks_with_another_arm():
    result = subprocess.run([sys.executable, "-c", PICK], capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-1] == "True False (6,) [0.075 0.    0.03 ]"
