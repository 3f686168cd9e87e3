"""Pictures that are worse than assumed raise the covariance instead of alarms; brightness and hue may change."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from pinhole_scene import Scene, fixating_pose, noise_texture, observe, upright

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.detection.colour import ColourDetector
from fixation_gym.perception.detection.colour_shift import RED, colour_in_box
from fixation_gym.perception.detection.tracking import FIRST_LOOK
from fixation_gym.perception.flow import optic_flow
from fixation_gym.perception.flow.brightness import is_dark, relative_gain, without_gain
from fixation_gym.perception.flow.optic_flow import estimate_flow
from fixation_gym.perception.pipeline import Perception

CAMERA = Intrinsics.from_fovy(120, 160, 0.74)
TARGET = np.array([0.6, 0.0, 0.2])
SCENE = Scene(
    [
        upright([0.7, 0.0, 0.2], 1.0, 0.8, noise_texture(1, contrast=0.15)),
        upright(TARGET, 0.05, 0.05, noise_texture(2, (1.0, 0.1, 0.1), 0.2)),
    ]
)
BOX = np.array([60.0, 40.0, 40.0, 40.0])


def still(noise_std, seed=0, level=128.0):
    """Three pictures of one textured plane at rest, with white noise."""
    rng = np.random.default_rng(seed)
    texture = cv2.resize(noise_texture(3)[..., 0], (160, 120)) * np.float32(level / 128.0)
    return [(texture + noise_std * rng.standard_normal(texture.shape)).astype(np.float32) for _ in range(3)]


def looks(change=lambda picture, step: picture):
    """Perception of a clear scene, the camera going to and fro; yields percepts."""
    perception = Perception(CAMERA)
    for step in range(24):
        pose = fixating_pose([0.0, 0.04 * np.sin(0.3 * step), 0.2], TARGET)
        observation, _, _ = observe(SCENE, pose, 0.04 * step, CAMERA, noise=1.0)
        yield perception.update(replace(observation, rgb=change(observation.rgb, step)))


def test_pictures_as_good_as_assumed_are_taken_as_they_are():
    assert not any(percept.flow.imperfect for percept in looks())
    flow = estimate_flow(still(1.0), (0.0, 0.04, 0.08), CAMERA)
    assert not flow.imperfect


@pytest.mark.parametrize("std", [6.0, 8.0, 12.0])
def test_the_stated_covariance_is_that_of_the_noise_in_the_pictures(std):
    assumed = estimate_flow(still(1.0), (0.0, 0.04, 0.08), CAMERA)
    errors, stated = [], []
    for seed in range(6):
        flow = estimate_flow(still(std, seed), (0.0, 0.04, 0.08), CAMERA)
        assert flow.imperfect
        errors.append(flow.residual[0][flow.overlap])
        stated.append(np.sqrt(flow.residual_cov[0][flow.overlap]))
    assert np.median(stated) > 1.15 * np.median(np.sqrt(assumed.residual_cov[0][assumed.overlap]))
    ratio = np.median(np.abs(errors)) / 0.6745 / np.median(stated)
    assert ratio < 1.0  # never surer than it is right


def alarms(percepts):
    """Mean share of cells in alarm; nothing is in front."""
    return np.mean([(percept.zfc.cells > 128).mean() for percept in percepts])


def test_compression_raises_the_covariance_instead_of_alarms(monkeypatch):
    def compressed(picture, step):
        data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 20])[1]
        return np.ascontiguousarray(cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1])

    percepts = list(looks(compressed))[4:]
    assert np.mean([percept.flow.imperfect for percept in percepts]) > 0.9
    monkeypatch.setattr(optic_flow, "take_own_noise", lambda *_: (False, 1.0))
    unaware = list(looks(compressed))[4:]
    assert alarms(percepts) < 0.4 * alarms(unaware)
    stated, before = (np.median(p[-1].zfc.inverse_depth_std) for p in (percepts, unaware))
    assert stated > 1.2 * before


def test_flicker_does_not_alarm_where_nothing_is_in_front():
    def flickering(picture, step):
        factor = np.float32(0.8 * (1.0 + 0.25 * np.sin(2.5 * step)))
        return np.clip(np.rint(picture * factor), 0, 255).astype(np.uint8)

    percepts = list(looks(flickering))[4:]
    assert alarms(percepts) < 0.01
    assert percepts[-1].fixation.distance_m == pytest.approx(0.6, rel=0.05)


def test_the_gain_between_pictures_is_found_and_taken_out():
    middle = still(1.0)[1]
    for gain in (0.7, 1.05, 1.25):
        other = gain * np.float32(1.0) * still(1.0, 1)[1]
        assert relative_gain(middle, other) == pytest.approx(gain, rel=0.01)
        np.testing.assert_allclose(without_gain(other, gain).mean(), middle.mean(), rtol=0.01)
    assert relative_gain(middle, still(1.0, 1)[1]) == 1.0
    assert relative_gain(middle, np.roll(middle, 20, axis=1)) == 1.0  # content that moved is no gain
    assert relative_gain(np.zeros_like(middle), middle) == 1.0


def test_little_light_is_told_from_the_usual():
    assert is_dark(still(1.0, level=30.0)[0])
    assert not is_dark(still(1.0)[0])


def painted(hue_deg, value, background=(90, 90, 90)):
    """A picture with a square of a hue and brightness."""
    colour = cv2.cvtColor(np.float32([[[hue_deg % 360.0, 0.85, value]]]), cv2.COLOR_HSV2RGB)[0, 0]
    picture = np.full((120, 160, 3), background, np.uint8)
    picture[45:75, 65:95] = np.rint(255 * colour)
    return picture


@pytest.mark.parametrize(("turn", "value"), [(20.0, 0.8), (-25.0, 0.7), (0.0, 0.12), (20.0, 0.1)])
def test_a_turned_or_dark_target_is_found_by_its_box(turn, value):
    detector, picture = ColourDetector(CAMERA), painted(turn, value)
    observation, _, _ = observe(SCENE, fixating_pose([0.0, 0.0, 0.2], TARGET), 0.0, CAMERA)
    mask = detector.detect(replace(observation, rgb=picture, target_box=BOX), FIRST_LOOK)
    assert mask[46:74, 66:94].all()
    assert mask.sum() <= 900
    # It stays so for the episode, and is forgotten after.
    assert detector.detect(replace(observation, rgb=picture), FIRST_LOOK).any()
    detector.reset()
    assert not detector.detect(replace(observation, rgb=picture), FIRST_LOOK).any()


def test_a_box_without_such_a_colour_changes_nothing():
    assert colour_in_box(painted(0.0, 0.8), BOX, RED) is RED
    assert colour_in_box(painted(120.0, 0.8), BOX, RED) is RED  # green is no red in other light
    assert colour_in_box(painted(20.0, 0.8), np.zeros(4), RED) is RED
