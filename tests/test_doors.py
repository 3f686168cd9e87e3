"""The worked examples of ``docs/doors`` run as they are written, and do what they say."""

import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.types import Observation

DOORS = Path(__file__).parent.parent / "docs" / "doors"


def example(name):
    """Names that the Python code of a page defines."""
    blocks = re.findall(r"```python\n(.*?)```", (DOORS / f"{name}.md").read_text(), re.DOTALL)
    names = {"__name__": f"example_{name}"}
    exec(compile("\n".join(blocks), f"{name}.md", "exec"), names)
    return names


def circling(perception, steps=30, half_width=8):
    """Percepts of a green square of 4 cm, 0.5 m straight below a camera that circles and turns towards it."""
    for step in range(steps):
        time = 0.04 * step
        offset = 0.03 * np.array([np.sin(2.0 * time), np.cos(2.0 * time)])
        image = np.random.default_rng(1).integers(90, 110, (120, 160, 3)).astype(np.uint8)
        focal = 60.0 / np.tan(0.35)
        column, row = np.rint([79.5, 59.5] - focal * offset / 0.5).astype(int)
        image[row - half_width : row + half_width, column - half_width : column + half_width] = 20, 220, 30
        position = [0.5 + offset[0], -offset[1], 0.5]
        pose = np.array([*position, 0.0, 1.0, 0.0, 0.0])
        yield perception.update(Observation(time, image, np.zeros(7), np.zeros(7), pose, np.zeros(6), 0.08))


def test_every_page_is_short_and_is_run_here_or_with_another_arm():
    for page in DOORS.glob("*.md"):
        assert len(page.read_text().splitlines()) < 70, page.name
        assert page.stem == "robot" or f'example("{page.stem}")' in Path(__file__).read_text(), page.name


def test_the_green_detector_finds_the_green_square_and_the_distance_follows():
    *_, percept = circling(example("detector")["perception"])
    assert percept.segmentation.area_fraction == pytest.approx(16 * 16 / (120 * 160))
    assert percept.fixation.distance_m == pytest.approx(0.5, rel=0.05)


def test_the_distance_from_a_known_width_needs_no_motion():
    names = example("estimator")
    green = example("detector")["GreenDetector"](names["camera"])
    side = 16 / (60.0 / np.tan(0.35)) * 0.5
    estimator = names["KnownWidth"](std_m=side / np.sqrt(12.0))
    percept = next(circling(names["Perception"](names["camera"], detector=green, estimator=estimator)))
    assert percept.fixation.distance_m == pytest.approx(0.5, rel=0.05)


def test_the_cautious_rule_calls_more_pixels_in_front():
    names = example("front_rule")
    green, camera = example("detector")["GreenDetector"], names["camera"]
    fronts = []
    for settings in (names["settings"], names["PerceptionSettings"]()):
        *_, percept = circling(names["Perception"](camera, settings, detector=green(camera)))
        fronts.append(np.count_nonzero(percept.zfc.p_nearer > 0.5))
    assert fronts[0] >= fronts[1]


@pytest.mark.sim
def test_straight_in_comes_to_the_target_and_grasps():
    env = gym.make("FixationPick-v0", scenario="clear")
    policy = example("policy")["StraightIn"](env.unwrapped)
    obs, info = env.reset(seed=1)
    policy.reset()
    for _ in range(250):
        obs, _, terminated, truncated, info = env.step(policy.act(obs))
        if policy.fixator.stage is not None or terminated or truncated:
            break
    env.close()
    assert policy.fixator.stage is not None
    assert info["distance_true_m"] < 0.22


@pytest.mark.sim
def test_a_gate_of_one_s_own_stands_where_it_was_put():
    names = example("obstacle")
    env = gym.make("FixationPick-v0", scenario=names["arches"], image_size=None)
    _, info = names["reset_with_gate"](env, seed=4)
    simulation = env.unwrapped.sim
    (gate,) = simulation.obstacles
    foot = simulation.body_position(gate) - np.array(env.unwrapped.scene.target.position)
    np.testing.assert_allclose(foot[:2], [0.02, 0.12], atol=1e-3)
    for _ in range(25):
        *_, info = env.step(np.zeros(7, np.float32))
    np.testing.assert_allclose(simulation.body_position(gate)[2], names["table"] + names["middle"], atol=2e-3)
    assert not info["collision"]
    with pytest.raises(ValueError, match="SceneSpec, got str"):
        env.reset(options={"scene": "clear"})
    many = names["with_gate"](env.unwrapped.scene)
    with pytest.raises(ValueError, match="obstacles may have 30, 14"):
        env.reset(options={"scene": names["replace"](many, obstacles=many.obstacles * 10)})
    env.close()
