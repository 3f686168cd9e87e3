"""Clock, shutter, lens and development of the wrist camera against what they promise."""

from dataclasses import replace
from itertools import pairwise

import cv2
import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym.envs.development import developed
from fixation_gym.envs.lens import bent_box, through_lens, wide_pinhole
from fixation_gym.envs.sensor_noise import SENSOR_NOISE, SensorNoise
from fixation_gym.envs.shutter import exposed_rows, row_weights
from fixation_gym.envs.wrist_camera import exposed, intrinsics_of, moved_on, switched_on
from fixation_gym.geometry.camera import Intrinsics, Lens
from fixation_gym.perception.rectification import Rectification

STEP, PERIOD = 0.002, 20
NOTHING = np.zeros(3)


def running(noise, periods, seed=0):
    """States of a camera whose scene has one coordinate, which is the time."""
    rng = np.random.default_rng(seed)
    state = switched_on(noise, np.zeros(1), STEP, rng)
    yield state
    for period in range(periods):
        times = STEP * (PERIOD * period + 1 + np.arange(PERIOD))
        state = moved_on(state, noise, times[:, None], rng)
        yield state


def ramp(qpos):
    """A picture whose grey level is 1000 times the coordinate."""
    return np.full((41, 8, 3), np.clip(1000.0 * qpos[0], 0, 255), np.float64)


def test_who_observes_knows_the_shutter():
    assert intrinsics_of((24, 32), SENSOR_NOISE["nominal"]).readout_s == 0.0
    assert intrinsics_of((24, 32), SensorNoise(readout_s=0.03, delay_s=0.015)).readout_s == 0.03
    assert intrinsics_of((24, 32), SENSOR_NOISE["realistic"]).readout_s == SENSOR_NOISE["realistic"].readout_s > 0.0


def test_a_camera_without_a_clock_takes_a_picture_at_every_step():
    noise = SensorNoise(image_latency_s=0.008)
    for count, state in enumerate(running(noise, 5)):
        assert state.stamp_s == pytest.approx(0.04 * count)
        shown = exposed(state, noise, lambda qpos: qpos)
        assert shown[0] == pytest.approx(max(0.0, 0.04 * count - 0.008))


def test_pictures_of_a_clock_arrive_late_in_order_and_some_never():
    noise = SensorNoise(frame_rate_hz=30.0, frame_jitter_s=1e-3, frame_drops=0.2, delay_s=0.03)
    states = list(running(noise, 2000))
    fresh = [now for before, now in pairwise(states) if now.stamp_s > before.stamp_s]
    stamps = np.array([state.stamp_s for state in fresh])
    ages = np.array([state.now - state.stamp_s for state in fresh])
    assert np.all(np.diff(stamps) > 0.0)
    assert np.all(ages >= 0.03 - 1e-9)
    # Steps between pictures are whole periods of the clock, with the jitter of two pictures.
    periods = np.diff(stamps) * 30.0
    assert (periods - periods.round()).std() == pytest.approx(np.sqrt(2) * 0.03, rel=0.2)
    # In every fifth step two pictures come, of which one is enough.
    assert len(stamps) == pytest.approx(2000 * (4 * 0.8 + 1 - 0.2**2) / 5, rel=0.03)


def test_the_clock_comes_from_the_generator_alone():
    noise = SENSOR_NOISE["realistic"]
    first, again, other = ([state.stamp_s for state in running(noise, 50, seed)] for seed in (1, 1, 2))
    assert first == again
    assert first != other


@pytest.mark.parametrize(("exposure", "readout"), [(0.0, 0.0), (0.012, 0.0), (0.0, 0.03), (0.008, 0.024)])
def test_each_row_is_the_mean_of_its_exposure(exposure, readout):
    noise = SensorNoise(exposure_s=exposure, readout_s=readout, delay_s=0.02)
    *_, state = running(noise, 5)
    image = exposed(state, noise, lambda qpos: ramp(qpos).astype(np.uint8))
    expected = 1000.0 * exposed_rows(state.stamp_s, readout, 41)
    np.testing.assert_allclose(image[:, 0, 0], expected, atol=1.5)  # whole grey levels, whole physics steps


def test_a_square_pulse_of_light_is_shared_by_the_rows_that_saw_it():
    rows, instants = exposed_rows(0.1, 0.02, 5), 0.08 + 0.002 * np.arange(21)
    weights = row_weights(instants, rows, 0.01)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0)
    np.testing.assert_allclose(instants @ weights, rows)
    assert weights[instants < 0.0831, 0].sum() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(weights[:, 2][np.abs(instants - 0.1) < 0.0039], 0.2)


def test_what_a_lens_bends_is_straight_again_after_rectification():
    pinhole = Intrinsics.from_fovy(120, 160, 0.74)
    camera = replace(pinhole, lens=Lens((-0.3, 0.1, 0.001, -0.002)))
    wide = wide_pinhole(camera)
    rows, columns = np.mgrid[: wide.height, : wide.width]
    x, y = (columns - wide.cx) / wide.fx, (rows - wide.cy) / wide.fy
    scene = np.stack([127 + 100 * np.sin(25 * x), 127 + 100 * np.sin(25 * y), 0 * x], axis=-1).astype(np.uint8)
    assert wide.width > camera.width
    straight = Rectification(camera).image(through_lens(scene, camera)).astype(float)
    left, top = round(wide.cx - camera.cx), round(wide.cy - camera.cy)
    expected = scene[top : top + 120, left : left + 160].astype(float)
    assert np.abs(straight - expected)[8:-8, 8:-8].max() < 8  # two bilinear lookups
    bent = through_lens(scene, camera).astype(float)
    assert np.abs(bent - expected)[8:-8, 8:-8].max() > 30


def test_a_box_is_bent_as_the_picture_is():
    camera = replace(Intrinsics.from_fovy(120, 160, 0.74), lens=Lens((-0.3, 0.1, 0.0, 0.0)))
    box = np.array([100.0, 70.0, 30.0, 24.0])
    moved = bent_box(box, camera)
    assert moved[0] + moved[2] < 130.0  # a barrel draws things inwards
    back = Rectification(camera).box(moved)
    assert np.all(back[:2] <= box[:2])
    assert np.all(back[:2] + back[2:] >= box[:2] + box[2:])
    assert np.all(back[2:] - box[2:] < 3.0)  # sides are bent, and pixels whole
    np.testing.assert_array_equal(bent_box(box, camera.pinhole), box)


def test_flicker_has_its_frequency_and_is_averaged_over_the_exposure():
    image, rng = np.full((9, 8, 3), 100, np.uint8), np.random.default_rng(0)
    noise = SensorNoise(flicker=0.3, flicker_hz=120.0)
    quarter = 1 / 480
    levels = [developed(image, noise, 1.0, NOTHING, time, rng)[4, 0, 0] for time in (0.0, quarter, 3 * quarter)]
    assert levels == [100, 130, 70]
    whole = replace(noise, exposure_s=1 / 120, delay_s=1 / 240)
    np.testing.assert_array_equal(developed(image, whole, 1.0, NOTHING, quarter, rng), image)
    rolling = replace(noise, readout_s=1 / 120, delay_s=1 / 240)
    assert developed(image, rolling, 1.0, NOTHING, 0.0, rng)[[2, 6], 0, 0].tolist() == [70, 130]


def test_gains_wander_as_far_and_as_slowly_as_they_should():
    noise = SensorNoise(gain_drift=0.05, white_balance_drift=0.03, drift_time_s=2.0)
    drift = np.array([state.drift for state in running(noise, 20000)])
    np.testing.assert_allclose(drift.std(axis=0), [0.05, 0.03, 0.03], rtol=0.2)
    kept = [np.corrcoef(column[:-50], column[50:])[0, 1] for column in drift.T]  # 50 steps are 2 s
    np.testing.assert_allclose(kept, np.exp(-1.0), atol=0.15)
    image = np.full((4, 4, 3), 100, np.uint8)
    pixel = developed(image, SensorNoise(), 1.0, np.log([1.2, 1.1, 0.9]), 0.0, np.random.default_rng(0))[0, 0]
    assert pixel.tolist() == [132, 120, 108]


def test_hue_light_and_compression_change_what_they_name():
    rng = np.random.default_rng(0)
    red = np.full((32, 32, 3), (200, 20, 20), np.uint8)
    turned = developed(red, SensorNoise(hue_shift_deg=20.0), 1.0, NOTHING, 0.0, rng)
    hue, saturation, value = cv2.cvtColor(turned, cv2.COLOR_RGB2HSV)[0, 0]
    assert (hue, value) == (10, 200)
    assert saturation == pytest.approx(229.5, abs=1.0)
    assert developed(red, SensorNoise(light=0.25), 1.0, NOTHING, 0.0, rng)[0, 0].tolist() == [50, 5, 5]
    picture = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    errors = [
        np.abs(developed(picture, SensorNoise(jpeg_quality=quality), 1.0, NOTHING, 0.0, rng).astype(int) - picture)
        for quality in (95, 30)
    ]
    assert 0.0 < errors[0].mean() < errors[1].mean()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"exposure_s": 0.03}, "delay_s must be 0.015 s or more"),
        ({"jpeg_quality": 101}, "within 0..100"),
        ({"light": -1.0}, "0 or more"),
        ({"read_noise": "loud"}, "0 or more"),
        ({"frame_drops": 1.0}, "0..0.9"),
        ({"drift_time_s": 0.0}, "above 0"),
        ({"lens": (0.1,)}, "4 or 5 or 8"),
    ],
)
def test_noise_that_no_camera_has_is_refused_with_what_is_allowed(values, message):
    with pytest.raises(ValueError, match=message):
        SensorNoise(**values)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"delay_s": 20.0}, "delay_s must be 0.25 s or less"),
        ({"frame_rate_hz": 1e6}, "frame_rate_hz must be 0 or within 5.0..500.0"),
        ({"lens": 0.1}, "lens must be the coefficients"),
        ({"flicker": 0.3, "flicker_hz": 0.0}, "flicker_hz must be above 0"),
    ],
)
def test_what_is_no_camera_is_refused(values, message):
    with pytest.raises(ValueError, match=message):
        SensorNoise(**values)


@pytest.mark.sim
def test_a_camera_that_is_on_again_shows_its_newest_picture():
    env = gym.make(
        "FixationPick-v0", image_size=(48, 64), sensor_noise={"frame_rate_hz": 5.0, "delay_s": 0.03}
    ).unwrapped
    env.reset(seed=0)
    env.camera_on = False
    for _ in range(11):
        env.step(np.zeros(7))
    env.camera_on = True
    observation, *_ = env.step(np.zeros(7))
    assert observation["time"][0] - observation["image_time"][0] < 0.2 + 0.03 + 0.04
    env.close()


@pytest.mark.parametrize("k1", [-1.5, -1.0, -0.8])
def test_a_lens_that_folds_the_picture_over_is_refused_when_the_environment_is_made(k1):
    with pytest.raises(ValueError, match="bends the border of the picture too far"):
        gym.make("FixationPick-v0", sensor_noise={"lens": [k1, 0.0, 0.0, 0.0, 0.0]})
