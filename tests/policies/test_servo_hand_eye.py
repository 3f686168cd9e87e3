"""A servo with a badly mounted camera finds out how it is mounted, and then does as well as with a good one."""

from functools import cache

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fixation_gym.geometry.rigid import inverse, pose_to_matrix
from fixation_gym.perception.hand_eye.hand_eye_filter import HandEyeState
from fixation_policies.catalogue import make_policy

pytestmark = pytest.mark.sim

STEPS = 110
BAD = {"base": "nominal", "hand_eye_m": 3e-3, "hand_eye_rad": 0.012}
SEED = 3


@cache
def gazed(policy_name: str, bad: bool) -> tuple[HandEyeState | None, np.ndarray, float]:
    """What was learnt, the true camera in the believed one, (4, 4), and the median error of Z_f in the last second."""
    env = gymnasium.make("fixation_gym:FixationPick-v0", scenario="clear", sensor_noise=BAD if bad else "nominal")
    policy = make_policy(policy_name, env)
    obs, info = env.reset(seed=SEED)
    policy.reset(SEED)
    errors = []
    for _ in range(STEPS):
        action = policy.act(obs)
        errors.append(abs(policy.percept.fixation.distance_m / info["distance_true_m"] - 1.0))
        obs, _, _, _, info = env.step(action)
    T_base_true = env.unwrapped.sim.arm_state().camera_pose  # pyright: ignore[reportAttributeAccessIssue]
    T_believed_true = inverse(pose_to_matrix(obs["camera_pose"])) @ T_base_true
    env.close()
    return policy.percept.hand_eye, T_believed_true, float(np.median(errors[-25:]))


def test_what_is_learnt_is_how_the_camera_is_mounted():
    state, T_believed_true, _ = gazed("servo", bad=True)
    assert state is not None
    assert state.proven
    rotation = Rotation.from_matrix(T_believed_true[:3, :3]).as_rotvec()
    assert np.linalg.norm(rotation) > 0.012
    assert np.abs(state.mean[3:6] - rotation).max() < 4e-3
    assert np.abs(state.mean[:3] - T_believed_true[:3, 3]).max() < 2.5e-3


def test_the_distance_is_right_again():
    _, _, corrected = gazed("servo", bad=True)
    _, _, believed = gazed("servo:no_hand_eye", bad=True)
    assert corrected < 0.5 * believed


def test_a_good_mount_is_not_touched():
    state, _, with_it = gazed("servo", bad=False)
    _, _, without = gazed("servo:no_hand_eye", bad=False)
    assert state is not None
    assert state.pictures > 50
    assert not state.proven
    assert with_it == without
