"""The servo drives a robot at a steady rate, and the robot rests at the end: put your own ``Robot`` in its place."""

from contextlib import closing
from typing import Any

import gymnasium as gym

import fixation_gym  # noqa: F401
from fixation_gym.envs.simulated_robot import SimulatedRobot
from fixation_gym.perception import Perception
from fixation_gym.robot_loop import LoopReport, LoopSettings, run_loop
from fixation_gym.robots import ROBOT
from fixation_policies.servo.servo_policy import ServoPolicy


def main(scenario: str = "opaque", seed: int = 1, settings: LoopSettings | None = None) -> LoopReport:
    """Let the servo pick; returns how the loop ended."""
    env: Any = gym.make("FixationPick-v0", scenario=scenario).unwrapped
    camera = env.intrinsics  # of your camera: a calibration
    policy = ServoPolicy(Perception(camera, support_height_m=ROBOT.workspace.table_height))
    robot = SimulatedRobot(env, seed)
    # Simulated time passes while the loop waits. With a real robot leave the clock out: the computer's keeps the rate.
    with closing(env):
        report = run_loop(robot, policy, settings, clock=robot)
    print(f"{report.end.value}: {report.sentence}; {report.periods} periods, {report.late} of them late")
    return report


if __name__ == "__main__":
    main()
