"""The fixator: gaze on the target whatever velocity is asked for, and one grasp at a time."""

import numpy as np
import pytest

from fixation_gym.control.open_loop import OpenLoopGains, Stage, Target, largest_roll
from fixation_gym.fixator import Fixator, FixatorGains, action_of
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import look_at, matrix_to_pose
from fixation_gym.geometry.twist import exp_twist
from fixation_gym.perception import Perception
from fixation_gym.types import Observation

CAMERA = Intrinsics.from_fovy(120, 160, 1.0)
TARGET = np.array([0.55, 0.0, -0.08])
UP = np.array([0.0, 0.0, 1.0])
START = look_at(np.array([0.30, -0.25, 0.25]), TARGET + np.array([0.02, 0.02, 0.0]), UP)
X, Y = CAMERA.grid
RAYS = np.stack([X, Y, np.ones_like(X)], -1) / np.linalg.norm(np.stack([X, Y, np.ones_like(X)], -1), axis=-1)[..., None]


def observation(T_base_cam, time):
    offset = T_base_cam[:3, :3].T @ (TARGET - T_base_cam[:3, 3])
    along = RAYS @ offset
    hit = (along > 0) & (offset @ offset - along**2 < 0.03**2)
    rgb = np.where(hit[..., None], np.array([200, 10, 10]), 128).astype(np.uint8)
    return Observation(time, rgb, np.zeros(7), np.zeros(7), matrix_to_pose(T_base_cam), np.zeros(6), 0.08)


def run(fixator, velocity, steps, grasp_at=None):
    """Steer a camera that does as it is told; yields pose, command and stage."""
    T_base_cam = START
    for step in range(steps):
        fixator.look(observation(T_base_cam, 0.04 * step))
        command = fixator.steer(velocity, grasp=step == grasp_at)
        yield T_base_cam, command, fixator.stage
        T_base_cam = T_base_cam @ exp_twist(command.camera_twist, 0.04)


@pytest.mark.parametrize("velocity", [(0.05, 0.0, 0.0), (0.0, -0.05, 0.02), (-0.03, 0.03, 0.03)])
def test_the_gaze_is_on_the_target_whatever_velocity_is_asked_for(velocity):
    *_, (T_base_cam, command, _) = run(Fixator(Perception(CAMERA)), np.array(velocity), 60)
    x, y, z = T_base_cam[:3, :3].T @ (TARGET - T_base_cam[:3, 3])
    assert np.hypot(x, y) / z < 0.02
    assert np.linalg.norm(command.camera_twist[3:5]) > 0.01


def test_a_grasp_takes_over_until_it_ends_and_begins_but_once():
    fixator = Fixator(Perception(CAMERA), FixatorGains(open_loop=OpenLoopGains(close_seconds=0.2)))
    stages = [stage for *_, stage in run(fixator, np.array([0.0, 0.0, 0.08]), 230, grasp_at=60)]
    assert stages[59] is None
    assert stages[60] is Stage.GRASP
    order = list(dict.fromkeys(stage for stage in stages if stage is not None))
    assert order[:2] == [Stage.GRASP, Stage.CLOSE]


def test_before_anything_was_seen_it_says_so_and_does_not_grasp():
    fixator = Fixator(Perception(CAMERA))
    with pytest.raises(RuntimeError, match=r"call look\(\) first"):
        _ = fixator.percept
    away = look_at(np.array([0.3, 0.0, 0.3]), np.array([-1.0, 0.0, 0.3]), UP)
    fixator.look(observation(away, 0.0))
    command = fixator.steer(np.zeros(3), grasp=True)
    assert fixator.stage is None
    assert np.linalg.norm(command.camera_twist[3:5]) > 0.1  # it searches
    assert action_of(command).shape == (7,)


def test_low_things_leave_no_room_for_a_turned_hand_and_high_ones_do():
    pose = look_at(np.array([0.3, 0.0, 0.25]), TARGET, UP)
    targets = [Target(np.array([0.55, 0.0, height]), 0.02, 0.0) for height in (0.012, 0.020, 0.030, 0.060)]
    rolls = [largest_roll(pose, target, OpenLoopGains()) for target in targets]
    assert rolls[0] == 0.0
    assert np.all(np.diff(rolls) >= 0.0)
    assert rolls[-1] == pytest.approx(np.pi / 2)
    assert largest_roll(pose, Target(TARGET, None, 0.0), OpenLoopGains()) == pytest.approx(np.pi / 2)


def test_how_much_too_far_the_hand_is_turned_depends_on_how_low_the_target_is(monkeypatch):
    fixator, turned = Fixator(Perception(CAMERA)), START @ exp_twist(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1]), 1.0)
    fixator.look(observation(turned, 0.0))
    assert fixator.excess_roll() == 0.0  # nothing is known of the target's body
    for height, excess in ((0.012, 0.1), (0.060, 0.0)):
        low = Target(np.array([0.55, 0.0, height]), 0.02, 0.0)
        monkeypatch.setattr(Fixator, "target", property(lambda _, low=low: low))
        assert fixator.excess_roll() == pytest.approx(excess, abs=0.005)
