"""What a box names is followed through made-up sequences whose every pixel is known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, look_at, matrix_to_pose, transform
from fixation_gym.perception.detection.box_tracker import BoxTracker
from fixation_gym.perception.detection.detector import Sighting
from fixation_gym.perception.detection.segmentation import segmentation_of
from fixation_gym.perception.detection.tracking import FIRST_LOOK, Expectation
from fixation_gym.types import Observation

CAMERA = Intrinsics.from_fovy(240, 320, 0.74)
POSE = np.array([0.4, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0])
BLUE, SPOT, GREEN = (45, 75, 170), (200, 190, 60), (40, 120, 50)


def table(seed=0):
    """A background of greys and browns."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(70, 150, (24, 32, 1)) + np.array([15, 0, -20]) * rng.integers(0, 2, (24, 32, 1))
    fine = cv2.resize(coarse.astype(np.float32), (320, 240), interpolation=cv2.INTER_CUBIC)
    return np.clip(fine + rng.normal(0, 4, fine.shape), 0, 255).astype(np.uint8)


def drawn(image, place, radius=18.0):
    """A spotted disc in an image, and its pixels."""
    image, mask = image.copy(), np.zeros((240, 320), np.uint8)
    x, y = (round(value) for value in place)
    cv2.circle(image, (x, y), round(radius), BLUE, -1)
    cv2.circle(image, (round(x - 0.3 * radius), y), round(0.3 * radius), SPOT, -1)
    cv2.circle(mask, (x, y), round(radius), 1, -1)
    return image, mask > 0


class Watch:
    """A tracker with a camera that knows where the disc is, but for some pixels, and how much nearer it came."""

    def __init__(self, image, place, radius=18.0):
        self.tracker, self.time = BoxTracker(CAMERA), 0.0
        box = np.array([place[0] - radius - 1, place[1] - radius - 1, 2 * radius + 3, 2 * radius + 3])
        self.last = self.tracker.detect(observation(image, target_box=box), FIRST_LOOK), radius

    def look(self, image, place=None, radius=18.0):
        """Pixels found in the next image; ``place`` None: the disc may be anywhere."""
        expected, (before, radius_before) = FIRST_LOOK, self.last
        if place is not None:
            size = np.sqrt(0.5 * np.trace(segmentation_of(before, CAMERA).second_moments))
            centroid = CAMERA.normalise(np.add(place, (1.5, -1.0)))
            expected = Expectation(centroid, 0.12, size * radius / radius_before)
        self.time += 0.04
        mask = self.tracker.detect(observation(image, self.time), expected)
        if segmentation_of(mask, CAMERA).visible:
            self.last = mask, radius
        return mask


def observation(image, time=0.0, **more):
    noisy = np.random.default_rng(round(1000 * time)).normal(image, 2.0)
    rgb = np.clip(noisy, 0, 255).astype(np.uint8)
    return Observation(time, rgb, np.zeros(7), np.zeros(7), POSE, np.zeros(6), 0.08, **more)


def overlap(found, true):
    return np.count_nonzero(found & true) / np.count_nonzero(found | true)


def test_something_passes_in_front_the_rest_is_seen_then_nothing_then_all_of_it():
    place = (160, 120)
    image, true = drawn(table(), place)
    watch, hidden, mask = Watch(image, place), False, true
    for step in range(1, 80):
        left, covered = 60 + 2 * step, image.copy()
        covered[:, left : left + 50] = GREEN
        rest = true.copy()
        rest[:, left : left + 50] = False
        mask = watch.look(covered, place)
        share = np.count_nonzero(rest) / np.count_nonzero(true)
        hidden |= share == 0.0
        if share > (0.7 if hidden else 0.4):
            assert overlap(mask, rest) > 0.8, step
        if share == 0.0:
            assert np.count_nonzero(mask) < 0.1 * np.count_nonzero(true), step
    assert hidden
    assert overlap(mask, true) > 0.9


@pytest.mark.parametrize("shade", [(50, 80, 160), (38, 64, 140)])
def test_a_sheet_of_nearly_its_colour_that_slides_under_it_is_not_taken_for_it(shade):
    place = (160, 120)
    plain = table()
    watch = Watch(drawn(plain, place)[0], place)
    for step in range(1, 50):
        background = plain.copy()
        background[130:230, 260 - 3 * step : 300 - step] = shade
        image, true = drawn(background, place)
        assert overlap(watch.look(image, place), true) > 0.75, step


def test_a_shadow_on_the_table_and_on_it_changes_nothing():
    place = (160, 120)
    image, true = drawn(table(), place)
    watch = Watch(image, place)
    for step in range(1, 60):
        light = np.ones((240, 320), np.float32)
        light[:, : 100 + 2 * step] = 0.65
        shaded = (image * cv2.GaussianBlur(light, (0, 0), 3)[..., None]).astype(np.uint8)
        assert overlap(watch.look(shaded, place), true) > 0.8, step


def test_it_is_followed_while_it_grows_threefold_and_shrinks_again():
    watch = Watch(drawn(table(), (160, 120), 14)[0], (160, 120), 14)
    for step, radius in enumerate([*np.geomspace(14, 42, 40), *np.geomspace(42, 14, 40)], 1):
        place = (160 + 0.5 * step, 120 - 0.3 * step)
        image, true = drawn(table(), place, radius)
        assert overlap(watch.look(image, place, radius), true) > 0.85, step


def test_after_its_place_was_forgotten_it_is_found_at_another_size_but_not_where_it_is_not():
    watch = Watch(drawn(table(), (160, 120))[0], (160, 120))
    other = table(1)
    cv2.rectangle(other, (30, 30), (120, 200), (110, 60, 140), -1)
    for _ in range(4):
        assert not watch.look(other).any()
    image, true = drawn(table(1), (220, 90), 30)
    assert overlap([watch.look(image) for _ in range(4)][-1], true) > 0.85


@pytest.mark.parametrize("error", [(0, 0, 1.2), (0, 0, 0.8), (-0.2, 0, 1.0), (0.15, 0.15, 1.0), (0, -0.2, 1.0)])
def test_a_box_that_is_a_fifth_too_large_too_small_or_beside_it_shows_the_same(error):
    right, down, size = error
    image, true = drawn(table(), (160, 120), 24)
    side = size * 49
    box = np.array([159.5 + 49 * right - side / 2, 119.5 + 49 * down - side / 2, side, side])
    assert overlap(BoxTracker(CAMERA).detect(observation(image, target_box=box), FIRST_LOOK), true) > 0.9


# -- a pattern that goes on beyond the box --------------------------------------------------------------------------

BOARD = np.kron(np.indices((8, 11)).sum(axis=0) % 2, np.ones((20, 20))).astype(np.uint8) * 170 + 40  # 1 px is 1 mm
BOX_MM = np.array([[40, 40], [179, 40], [179, 119], [40, 119]], float)


def board_seen_from(pose):
    """Picture of a chessboard that lies in the plane z = 0 of base, and the pixels of its middle part."""
    T = inverse(pose)
    corner = np.array([-0.11, -0.08, 0.0])  # of the board, in base
    columns = [0.001 * T[:3, 0], 0.001 * T[:3, 1], transform(T, corner)]
    homography = CAMERA.matrix @ np.column_stack(columns)
    rim = np.pad(BOARD, 12, constant_values=225)
    to_rim = homography @ np.array([[1.0, 0.0, -12.0], [0.0, 1.0, -12.0], [0.0, 0.0, 1.0]])
    image = cv2.cvtColor(table(), cv2.COLOR_RGB2GRAY)
    cv2.warpPerspective(rim, to_rim, (320, 240), dst=image, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_TRANSPARENT)
    corners = cv2.perspectiveTransform(BOX_MM[None], homography)[0]
    mask = cv2.fillConvexPoly(np.zeros((240, 320), np.uint8), np.rint(corners).astype(np.int32), 1) > 0
    return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), mask


STILLS = [
    look_at(np.array(place), np.array(gaze), up)
    for place, gaze, up in (
        ([0.0, -0.02, 0.42], [0.0, 0.0, 0.0], np.array([0.0, 1.0, 0.0])),
        ([0.10, -0.10, 0.45], [0.01, 0.02, 0.0], np.array([0.0, 1.0, 0.0])),
        ([-0.16, 0.05, 0.40], [-0.03, 0.0, 0.0], np.array([1.0, 0.2, 0.0])),
        ([0.05, 0.2, 0.38], [0.0, -0.02, 0.0], np.array([-0.5, 1.0, 0.0])),
        ([0.0, -0.22, 0.5], [0.04, 0.02, 0.0], np.array([0.0, 1.0, 0.0])),
    )
]


def test_part_of_a_repeated_pattern_is_found_in_stills_by_how_the_camera_moved_between_them():
    tracker = BoxTracker(CAMERA)
    for step, pose in enumerate(STILLS):
        image, true = board_seen_from(pose)
        box = np.array(cv2.boundingRect(true.view(np.uint8)), float) if step == 0 else None
        seen = observation(image, 0.5 * step, target_box=box)
        found = tracker.detect(replace(seen, camera_pose=matrix_to_pose(pose)), FIRST_LOOK)
        if step == 0:
            assert overlap(found, true) > 0.95
            continue
        assert isinstance(found, Sighting)
        assert overlap(found.mask, true) > 0.85, step
        x, y, z = transform(inverse(pose), np.array([-0.0005, -0.0005, 0.0]))
        np.testing.assert_allclose(found.point, [x / z, y / z], atol=1.5 / CAMERA.fx)
    seen = observation(table(1), 3.0)
    assert not np.any(tracker.detect(replace(seen, camera_pose=matrix_to_pose(STILLS[0])), FIRST_LOOK))


def test_a_box_that_vanishes_when_a_large_picture_is_reduced_is_refused():
    large = Intrinsics.from_fovy(960, 1280, 0.74)
    image = cv2.resize(table(), (1280, 960), interpolation=cv2.INTER_NEAREST)
    seen = observation(image, target_box=np.array([602.0, 402.0, 3.0, 3.0]))
    with pytest.raises(ValueError, match="must hold more than a pixel of the image at 320 x 240"):
        BoxTracker(large).detect(seen, FIRST_LOOK)
