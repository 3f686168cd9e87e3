"""The shifts: each changes the picture or the scene in the way that it says, and nothing else."""

import colorsys
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from fixation_gym.envs.config import resolve_scenario
from fixation_gym.envs.development import developed
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import RED, ROOM
from fixation_gym.envs.sensor_noise import SENSOR_NOISE, SensorNoise, resolve_sensor_noise
from fixation_gym.errors import UsageError
from fixation_gym.experiments.transfer.shifts import AXES, NONE, SEVERITIES, Shift, shift, table_hash

SAME_SCENES = [name for name, axis in AXES.items() if axis.same_scenes]


def scene(arguments, seed):
    return sample_scene(resolve_scenario(arguments["scenario"]), np.random.default_rng(seed))


def scenes(axis, severity, count=6):
    return [scene(shift(axis, severity).arguments("opaque"), seed) for seed in range(count)]


PLAIN = [scene(Shift(NONE, NONE).arguments("opaque"), seed) for seed in range(6)]


def test_the_table_is_frozen():
    # A change makes earlier results incomparable: say so in the changelog, and measure again.
    assert table_hash() == "e29d898c583fadb9270eb07ddbd4d278bf2b9476c298701ddd35ff9f48660c8a"


def test_no_shift_is_the_training():
    assert Shift(NONE, NONE).arguments("opaque") == {"scenario": "opaque", "sensor_noise": "nominal"}


@pytest.mark.parametrize(
    ("axis", "severity", "message"),
    [
        ("fog", "mild", "unknown axis 'fog'; choose one of material_translucent"),
        ("clutter", "extreme", "unknown severity 'extreme'; choose one of mild, middle, strong"),
    ],
)
def test_a_shift_that_does_not_exist_is_refused_with_what_there_is(axis, severity, message):
    with pytest.raises(UsageError, match=message):
        shift(axis, severity)


@pytest.mark.parametrize("axis", AXES)
def test_every_axis_has_three_severities_of_its_own(axis):
    shifts = [shift(axis, severity).arguments("opaque") for severity in SEVERITIES]
    values = [(resolve_scenario(s["scenario"]), resolve_sensor_noise(s["sensor_noise"])) for s in shifts]
    assert len({repr(value) for value in values}) == 3
    assert (resolve_scenario("opaque"), SENSOR_NOISE["nominal"]) not in values


def undressed(a):
    """A scene without its colours, textures and light."""
    obstacles = tuple(replace(o, tint=RED, frame_rgba=RED, texture="") for o in a.obstacles)
    target = replace(a.target, rgba=RED)
    return replace(a, obstacles=obstacles, target=target, room=(), light_direction=(0.0, 0.0, -1.0))


@pytest.mark.parametrize("axis", SAME_SCENES)
def test_the_same_things_stand_in_the_same_places(axis):
    assert [undressed(a) for a in scenes(axis, "strong")] == [undressed(a) for a in PLAIN]


def no_redder(colours):
    """No colour has more red than green: no texture gets redder than it is."""
    return all(rgba[0] <= rgba[1] + 1e-9 for rgba in colours)


@pytest.mark.parametrize("severity", SEVERITIES)
def test_textures_of_obstacles_leave_target_and_room_alone(severity):
    for a, plain in zip(scenes("object_textures", severity), PLAIN, strict=True):
        assert replace(a, obstacles=plain.obstacles) == plain
        assert no_redder([o.tint for o in a.obstacles] + [o.frame_rgba for o in a.obstacles])
        textures = [o.texture for o in a.obstacles]
        assert (textures == [o.texture for o in plain.obstacles]) or severity != "mild"
        assert set(textures) == {"wood_plain"} or severity != "strong"


@pytest.mark.parametrize("severity", SEVERITIES)
def test_textures_of_the_room_leave_target_and_obstacles_alone(severity):
    for a, plain in zip(scenes("background_textures", severity), PLAIN, strict=True):
        assert replace(a, room=()) == plain
        assert no_redder([surface.rgba for surface in a.room])
        assert tuple(surface.name for surface in a.room) == ROOM
        assert {surface.texture for surface in a.room} == {"wood_plain"} or severity != "strong"


@pytest.mark.parametrize(("severity", "degrees"), [("mild", 30.0), ("middle", 90.0), ("strong", 180.0)])
def test_the_targets_hue_turns_by_what_is_said(severity, degrees):
    before = colorsys.rgb_to_hsv(*RED[:3])
    sides = set()
    for a in scenes("target_colour", severity, 12):
        hue, saturation, value = colorsys.rgb_to_hsv(*a.target.rgba[:3])
        turn = (hue - before[0] + 0.5) % 1.0 - 0.5
        assert 360.0 * abs(turn) == pytest.approx(degrees)
        assert (saturation, value) == pytest.approx(before[1:])
        sides.add(turn > 0)
    assert sides == {True, False} or severity == "strong"


def test_a_target_that_is_not_red_is_followed_by_its_box():
    assert resolve_scenario("opaque").red_target
    assert not resolve_scenario(shift("target_colour", "mild").arguments("opaque")["scenario"]).red_target


def test_light_comes_from_the_same_side_but_lower():
    for a, plain in zip(scenes("light_direction", "middle"), PLAIN, strict=True):
        assert a.light_direction == pytest.approx((4 * plain.light_direction[0], 4 * plain.light_direction[1], -1.0))
        assert replace(a, light_direction=plain.light_direction) == plain


@pytest.mark.parametrize("material", ["translucent", "mirror", "wire"])
def test_obstacles_are_of_the_material(material):
    kinds = [{o.kind for o in a.obstacles} for a in scenes(f"material_{material}", "strong")]
    assert all(kind == {material} for kind in kinds)
    kinds = [{o.kind for o in a.obstacles} for a in scenes(f"material_{material}", "middle")]
    assert all(material in kind for kind in kinds)


def test_there_are_more_obstacles():
    fewest = [min(len(a.obstacles) for a in scenes("clutter", severity, 3)) for severity in SEVERITIES]
    assert fewest == [4, 5, 6]


@pytest.mark.parametrize(("severity", "low", "high"), [("mild", 36, 40), ("middle", 33, 36), ("strong", 30, 33)])
def test_the_first_view_is_lower(severity, low, high):
    for a in scenes("initial_view", severity, 3):
        x, y, z = np.subtract(a.camera_position, a.target.position)
        assert low <= np.degrees(np.arctan2(z, np.hypot(x, y))) <= high


def test_light_of_another_colour_scales_red_and_blue():
    image = np.full((8, 8, 3), 100, np.uint8)
    warm = developed(image, SensorNoise(light_red=1.5, light_blue=0.4), 1.0, np.zeros(3), 0.0, np.random.default_rng(0))
    assert {tuple(pixel) for pixel in warm.reshape(-1, 3).tolist()} == {(150, 100, 40)}


@pytest.fixture(scope="module")
def unshifted():
    return picture(Shift(NONE, NONE))


def picture(chosen):
    """First picture of an episode, shape (96, 128, 3), float."""
    env = gym.make("FixationPick-v0", image_size=(96, 128), **chosen.arguments("opaque"))
    image = env.reset(seed=100_001)[0]["rgb"].astype(float)
    env.close()
    return image


def target_pixels(image):
    """Pixels well inside the red target."""
    red = (image[..., 0] > 3.0 * image[..., 1:].max(2)) & (image[..., 0] > 60.0)
    inner = red.copy()
    for axis in (0, 1):
        for step in (-2, -1, 1, 2):
            inner &= np.roll(red, step, axis)
    assert inner.sum() > 30
    return inner


@pytest.mark.sim
@pytest.mark.parametrize("axis", ["object_textures", "background_textures"])
def test_pictures_show_other_surroundings_and_the_same_target(axis, unshifted):
    shifted, target = picture(shift(axis, "strong")), target_pixels(unshifted)
    assert np.mean(np.abs(shifted - unshifted).max(2)[~target] > 30.0) > 0.1
    np.testing.assert_array_equal(shifted[target], unshifted[target])


@pytest.mark.sim
def test_pictures_show_the_light(unshifted):
    dark = picture(shift("light_intensity", "middle"))
    assert dark.mean() / unshifted.mean() == pytest.approx(0.25, abs=0.02)
    warm = picture(shift("light_colour", "middle"))
    unsaturated = unshifted.max(2) < 150.0
    ratio = warm[unsaturated].mean(0) / unshifted[unsaturated].mean(0)
    assert ratio == pytest.approx([1.3, 1.0, 0.6], abs=0.03)
    slanted = picture(shift("light_direction", "strong"))
    assert np.mean(np.abs(slanted - unshifted).max(2) > 10.0) > 0.3


@pytest.mark.sim
def test_pictures_show_the_noise(unshifted):
    noisy = picture(shift("image_noise", "strong"))
    grey = unshifted[..., 1]
    middling = (grey > 40.0) & (grey < 200.0)
    spread = np.std((noisy - unshifted)[..., 1][middling])
    expected = np.sqrt(12.0**2 + 0.8 * grey[middling].mean())
    assert spread == pytest.approx(expected, rel=0.15)
