"""Follow a thing by its colours and its shape: which pixels are it, where the camera's motion says that it must be.

The shape is that of one image that is kept, moved along by the camera's motion to where the colours fit it best. Pixels
belong to the thing by their colour and by how deep they lie in that shape. The shape is taken from a newer image only
while the thing is seen as large as it must be by its distance: what covers it makes it smaller, what looks like it and
touches it makes it larger, and neither is learnt. Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from fixation_gym.perception.detection import colour_model
from fixation_gym.perception.detection.colour_model import ColourModel, colour_bins
from fixation_gym.perception.detection.moved_shape import (
    Affine,
    ScoreArray,
    Window,
    after,
    best_fit,
    box_of,
    cut_at_edges,
    depth_in,
    moved_mask,
    shifted,
    similarity,
    window_of,
)
from fixation_gym.perception.detection.picture import Picture, angle_between
from fixation_gym.perception.detection.segmentation import Segmentation, segmentation_of
from fixation_gym.perception.detection.shape_settings import ShapeSettings
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.types import FloatArray, MaskArray

_STILL: Affine = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_FEWEST = 20
"""Colours are not learnt from fewer pixels than this."""
_SCALES = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8)
"""Sizes at which a thing is looked for that may be anywhere, as multiples of the one at the first look."""


@dataclass(frozen=True, slots=True, eq=False)
class _Sight:
    """Pixels of the thing in an image, and how sure they are."""

    affine: Affine
    """From the shape that is kept to where it is."""
    window: Window
    found: MaskArray
    """Which pixels of the window are the thing."""
    share: float
    """Pixels found, as a share of the moved shape."""
    contrast: float
    """How much higher the colours score in the shape than around it."""


@dataclass(frozen=True, slots=True, eq=False)
class ColouredShape:
    """What is known of a thing that its colours tell from what is around it."""

    colours: ColourModel
    shape: MaskArray
    """Its pixels in the image that is kept."""
    affine: Affine
    """From there to where it was last seen, px."""
    view: FloatArray
    """Line of sight in base when that shape was seen, shape (3,)."""
    area: float
    """Of the whole thing where it was last seen, px."""
    first_area: float
    """At the first look, px."""
    centroid: FloatArray
    """Of the pixels last seen, normalised coordinates, shape (2,)."""
    size: float
    """Standard deviation of those, normalised coordinates."""
    rotation: FloatArray
    """Of the camera in base when last seen, shape (3, 3)."""
    likeness: float
    """How like the thing's colours its pixels usually are, 0..1."""
    contrast: float
    """How much higher its colours usually score in the shape than around it."""
    settings: ShapeSettings
    lost: bool = False
    settled: bool = True
    """Whether its size is known: when it comes back after long, maybe only a part of it is in the image."""

    def followed(self, picture: Picture, expected: Expectation) -> tuple[ColouredShape, MaskArray]:
        """What is known of it after an image, and its pixels, shape (h, w); none while it is lost."""
        nothing = replace(self, lost=True), np.zeros(picture.rgb.shape[:2], np.bool_)
        anywhere = not math.isfinite(expected.reach)
        sight = self._found_anywhere(picture) if anywhere else self._found_near(picture, expected)
        if sight is None:
            return nothing
        mask = np.zeros(picture.rgb.shape[:2], np.bool_)
        mask[sight.window] = sight.found
        seen = segmentation_of(mask, picture.camera)
        bins = colour_bins(picture.rgb[sight.window])
        likeness = self.colours.likeness(bins[sight.found])
        if not seen.visible or not self._is_it(sight, likeness):
            return nothing
        return self._learnt(picture, sight, seen, bins, likeness, anywhere), mask

    def _is_it(self, sight: _Sight, likeness: float) -> bool:
        settings = self.settings
        if not self.lost:
            return sight.share >= settings.least_seen and likeness >= settings.least_like * self.likeness
        return (
            sight.share >= settings.least_found
            and likeness >= settings.found_like * self.likeness
            and sight.contrast >= settings.found_contrast * self.contrast
        )

    def _found_near(self, picture: Picture, expected: Expectation) -> _Sight | None:
        """Where it is, near where it should be."""
        guess = self._guess(picture, expected)
        pixel = picture.camera.fx * expected.reach
        reach = pixel if self.lost else min(pixel, self.settings.shift * math.sqrt(self.area) + 4.0)
        return self._fitted(picture, guess, reach, expected.centroid)

    def _guess(self, picture: Picture, expected: Expectation) -> Affine:
        """How it should have moved since the image that is kept, by the motion of the camera."""
        turned = picture.rotation.T @ self.rotation
        angle = math.atan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1])
        scale = expected.size / self.size if expected.size > 0.0 and self.size > 0.0 else 1.0
        was, is_ = (picture.pixel(place) for place in (self.centroid, expected.centroid))
        return after(similarity(was, is_, angle, scale), self.affine)

    def _fitted(self, picture: Picture, guess: Affine, reach: float, place: FloatArray) -> _Sight | None:
        """The shape where the colours fit it best within reach of a guess, px; ``place``: the guess, normalised."""
        box = box_of(self.shape, guess)
        window = window_of(box, reach + _margin(box, self.settings), picture.rgb.shape[:2])
        if window is None:
            return None
        scores = _smooth(self.colours.scores(colour_bins(picture.rgb[window])))
        corner, template = self._template(box, guess)
        start = corner - np.array([window[1].start, window[0].start])
        contrast, shift = best_fit(scores, template, start, reach)
        affine = shifted(guess, shift)
        turned = angle_between(self.view, picture.line_of_sight(place)) if self.settled else 1.0
        return self._sight(picture, affine, window, scores, turned, contrast)

    def _template(self, box: FloatArray, affine: Affine) -> tuple[FloatArray, MaskArray]:
        """The moved shape with a margin, and the pixel of its top-left corner."""
        left, top, right, bottom = box
        margin = 0.2 * max(right - left, bottom - top) + 4.0
        x, y = math.floor(left - margin), math.floor(top - margin)
        part = slice(y, math.ceil(bottom + margin)), slice(x, math.ceil(right + margin))
        return np.array([x, y], np.float64), moved_mask(self.shape, affine, part)

    def _found_anywhere(self, picture: Picture) -> _Sight | None:
        """Where colours fit it best in the whole image, at any size."""
        full = self.colours.scores(colour_bins(picture.rgb))
        scores = np.asarray(cv2.resize(full, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.float32)
        half = similarity(np.zeros(2), np.array([-0.25, -0.25]), 0.0, 0.5)
        best, affine = -math.inf, None
        box = box_of(self.shape, _STILL)
        centre = np.array([box[0] + box[2], box[1] + box[3]]) / 2.0
        was = math.sqrt(self.first_area / max(1, np.count_nonzero(self.shape)))
        for scale in _SCALES:
            scaled = similarity(centre, centre, 0.0, scale * was)
            small = after(half, scaled)
            box = box_of(self.shape, small)
            if np.max(box[2:] - box[:2]) > scores.shape[0]:
                continue
            corner, template = self._template(box, small)
            contrast, shift = best_fit(scores, template, corner, math.inf)
            if contrast > best:
                best, affine = contrast, shifted(scaled, 2.0 * shift)
        if affine is None:
            return None
        box = box_of(self.shape, affine)
        window = window_of(box, _margin(box, self.settings), picture.rgb.shape[:2])
        if window is None:
            return None
        near = _smooth(self.colours.scores(colour_bins(picture.rgb[window])))
        return self._sight(picture, affine, window, near, 1.0, best)

    def _sight(
        self,
        picture: Picture,
        affine: Affine,
        window: Window,
        scores: ScoreArray,
        turned: float,
        contrast: float,
    ) -> _Sight | None:
        moved = moved_mask(self.shape, affine, window)
        if not moved.any():
            return None
        scores = scores + self._prior(moved, turned, picture.camera.width)
        found = cut_at_edges(picture.rgb[window], scores, self.settings.sure)
        return _Sight(affine, window, found, np.count_nonzero(found) / max(1, np.count_nonzero(moved)), contrast)

    def _prior(self, moved: MaskArray, turned: float, width: int) -> ScoreArray:
        """How much likelier pixels are on it by where they lie in the shape, natural logarithm."""
        settings = self.settings
        share = settings.softness + settings.turning * min(turned, 1.0)
        soft = settings.softness_px * width / 320 + share * math.sqrt(moved.sum())
        return np.clip(np.float32(settings.prior / soft) * depth_in(moved), -3.0 * settings.prior, settings.inside)

    def _learnt(
        self,
        picture: Picture,
        sight: _Sight,
        seen: Segmentation,
        bins: colour_model.BinArray,
        likeness: float,
        anywhere: bool,
    ) -> ColouredShape:
        """What is known after it was seen."""
        settings, found = self.settings, sight.found
        scale = math.sqrt(abs(np.linalg.det(sight.affine[:, :2]) / np.linalg.det(self.affine[:, :2])))
        view = picture.line_of_sight(seen.centroid)
        turned = angle_between(self.view, view)
        must = self.area * scale**2
        seen_area = float(np.count_nonzero(found))
        ratio = seen_area / max(1.0, must)
        now = replace(self, affine=sight.affine, area=must, centroid=seen.centroid, size=_size(seen))
        now = replace(now, rotation=picture.rotation, lost=False)
        if anywhere or not self.settled:
            settled = not seen.touches_border and abs(math.log(ratio)) < settings.settled
            return replace(now, shape=seen.mask, affine=_STILL, view=view, area=seen_area, settled=settled)
        whole = abs(math.log(max(ratio, 1e-3))) < settings.size_error + settings.size_turning * turned
        if seen.touches_border or not whole:
            return now
        moved = moved_mask(self.shape, sight.affine, sight.window)
        core = found & (depth_in(moved) > settings.softness_px + settings.softness * math.sqrt(must))
        if np.count_nonzero(core) < _FEWEST:
            core = found
        colours = colour_model.learnt(
            self.colours, bins, core, ~_grown(found | moved), settings.learning, settings.first_look
        )
        now = replace(
            now,
            colours=colours,
            likeness=0.9 * self.likeness + 0.1 * likeness,
            contrast=0.9 * self.contrast + 0.1 * sight.contrast,
        )
        total = math.sqrt(abs(np.linalg.det(sight.affine[:, :2])))
        if turned < settings.renewed_turn and abs(math.log(total)) < settings.renewed_scale:
            return now
        limit = settings.area_turning * turned + settings.area_still
        area = must * math.exp(min(max(math.log(ratio), -limit), limit))
        return replace(now, shape=seen.mask, affine=_STILL, view=view, area=area)


def first_shape(picture: Picture, mask: MaskArray, settings: ShapeSettings) -> ColouredShape:
    """What one image shows of a thing with these pixels, at least one."""
    box = box_of(mask, _STILL)
    window = window_of(box, _margin(box, settings), mask.shape)
    assert window is not None
    bins, inside = colour_bins(picture.rgb[window]), mask[window]
    near = colour_model.first_model(bins, inside, ~_grown(inside))
    everywhere = colour_model.histogram(colour_bins(picture.rgb)[~mask])
    around = 0.5 * (near.around + everywhere)
    colours = replace(near, around=around, first_around=around)
    seen = segmentation_of(mask, picture.camera)
    centroid = seen.centroid if seen.visible else np.zeros(2)
    scores = _smooth(colours.scores(bins))
    contrast = float(scores[inside].mean() - (scores[~inside].mean() if not inside.all() else 0.0))
    area = float(np.count_nonzero(mask))
    return ColouredShape(
        colours=colours,
        shape=mask,
        affine=_STILL,
        view=picture.line_of_sight(centroid),
        area=area,
        first_area=area,
        centroid=centroid,
        size=_size(seen) if seen.visible else 0.0,
        rotation=picture.rotation,
        likeness=colours.likeness(bins[inside]),
        contrast=contrast,
        settings=settings,
    )


def _margin(box: FloatArray, settings: ShapeSettings) -> float:
    return settings.surroundings * float(np.max(box[2:] - box[:2])) + 4.0


def _smooth(scores: ScoreArray) -> ScoreArray:
    return np.asarray(cv2.blur(scores, (3, 3)), np.float32)


def _size(seen: Segmentation) -> float:
    return math.sqrt(0.5 * float(np.trace(seen.second_moments)))


def _grown(mask: MaskArray) -> MaskArray:
    return cv2.dilate(mask.view(np.uint8), np.ones((5, 5), np.uint8)) > 0
