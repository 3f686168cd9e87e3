"""The centre of the target's body: which outlines are kept, and when they are no longer true."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.body.upright_body import (
    TANGENTS,
    BodyPrior,
    BodySettings,
    Outline,
    UprightBody,
    fit_upright_body,
    misfit,
    moved_body,
    outline_of,
    unknown_body,
)
from fixation_gym.perception.detection.segmentation import Segmentation
from fixation_gym.perception.distance.inverse_depth import MIN_DEPTH_M
from fixation_gym.perception.distance.pose_filter import Fixation
from fixation_gym.types import FloatArray, MaskArray


@dataclass(frozen=True, slots=True)
class CentreSettings:
    """Which outlines are kept, and when the fitted body is believed."""

    body: BodySettings = field(default_factory=BodySettings)
    """Noise of outlines and prior of the body."""
    baseline: float = 0.05
    """A new outline is kept when the camera moved by this share of the distance."""
    least_outlines: int = 6
    """A body is fitted first when there are so many."""
    max_outlines: int = 32
    """When there are more, every second of the older half goes."""
    contradiction_px: float = 3.0
    """A tangent that is seen by this farther out than the body reaches contradicts it, one farther in is covered ..."""
    contradiction_m: float = 0.003
    """... the former if by this much, too, m: close by, many pixels show that no body is exactly of the fitted kind."""
    moved_share: float = 0.1
    """If this share of an outline contradicts the body, that has moved, or is another one ..."""
    moved_frames: int = 3
    """... once so many frames, one by one, say so: a single one may be a bad image."""
    moved_misfit_px: float = 1.5
    """A known body that was moved fits its first outline as well as this, in the median."""
    doubts: int = 25
    """The body is forgotten after so many frames in sight, one by one, in which half of the outline is missing."""
    parted_share: float = 0.25
    """If this share of the outline is missing in every frame ..."""
    parted_turn: float = 0.25
    """... while the line of sight turns by this angle, nothing covers it, for that would move over it: the body was two
    things that touched, and is forgotten, rad."""
    largest_half_size_m: float = 0.065
    """What is longer is two things that touch in the image."""
    believed_std_m: float = 0.006
    """Standard deviation of the centre along the optical axis up to which it is believed."""

    def __post_init__(self) -> None:
        least = max(4, self.least_outlines)
        if self.max_outlines < least:
            raise ValueError(f"max_outlines must be at least {least}, got {self.max_outlines}")


@dataclass(frozen=True, slots=True, eq=False)
class TargetBody:
    """What outlines said so far."""

    outlines: tuple[Outline, ...] = ()
    body: UprightBody | None = None
    prior: BodyPrior | None = None
    """What is known of a body that has moved; None: nothing but what the outlines say."""
    doubts: int = 0
    """Frames in sight, one after the other, in which half of the outline was missing."""
    contradictions: int = 0
    """Frames in sight, one after the other, that contradict the body."""
    short_from: FloatArray | None = None
    """Direction in base to the camera, shape (3,), since which part of the outline is missing in every frame."""

    def believed(self, T_base_cam: FloatArray, settings: CentreSettings) -> UprightBody | None:
        """The body, if its depth from this camera is sure enough."""
        if self.body is None or self.body.depth(T_base_cam)[1] > settings.believed_std_m:
            return None
        return self.body


def with_outline(
    known: TargetBody,
    seen: Segmentation,
    fixation: Fixation,
    intrinsics: Intrinsics,
    T_base_cam: FloatArray,
    support_height: float,
    settings: CentreSettings,
) -> TargetBody:
    """Take in how the target is seen in a frame.

    What covers the target makes its outline smaller, never larger. So an outline that reaches beyond the body says that
    the body moved, or was covered when it was fitted; where an outline falls short something covers it.

    Args:
        known: what outlines said before.
        seen: target in the image.
        fixation: where it is about.
        intrinsics: of the image.
        T_base_cam: camera pose in base, shape (4, 4).
        support_height: height of the table in base, m.
        settings: of what to keep.
    """
    if not seen.visible:
        return known
    depth = fixation.distance_m if known.body is None else max(known.body.depth(T_base_cam)[0], MIN_DEPTH_M)
    newest = outline_of(seen.mask, intrinsics, T_base_cam, depth)
    if (expected := known.body) is not None:
        excess = misfit(expected, newest, support_height)
        least = max(settings.contradiction_px, settings.contradiction_m / (newest.pixel * depth))
        covered = excess >= settings.contradiction_px
        if np.count_nonzero(excess < -least) > settings.moved_share * TANGENTS:
            ray = T_base_cam[:3, :3] @ np.array([*fixation.centroid, 1.0])
            return _contradicted(known, expected, newest, ray, support_height, settings)
        short_from = _short_from(known, expected, newest, covered, settings)
        known = replace(known, contradictions=0, short_from=short_from)
        if short_from is not None and _turned(expected, newest, short_from) > settings.parted_turn:
            return TargetBody((newest,))
        newest = replace(newest, normals=newest.normals[~covered])
    if len(newest.normals) < TANGENTS / 2:
        doubts = known.doubts + 1
        return replace(known, doubts=doubts) if doubts < settings.doubts else TargetBody()
    if not _is_new_view(known.outlines, T_base_cam, settings.baseline * depth):
        return replace(known, doubts=0)
    outlines = (*_thinned(known.outlines, settings.max_outlines), newest)
    if known.body is None and len(outlines) < settings.least_outlines:
        return TargetBody(outlines)
    prior = known.prior or unknown_body(fixation.point_base, settings.body)
    if known.body is not None:  # no yaw is more likely than another
        prior = replace(prior, mean=np.array([*prior.mean[:2], known.body.parameters[2], *prior.mean[3:]]))
    body = fit_upright_body(outlines, prior, support_height, settings.body, known.body)
    if body.half_sizes.max() > settings.largest_half_size_m:
        return TargetBody((newest,))
    return TargetBody(outlines, body, known.prior, short_from=known.short_from)


def _short_from(
    known: TargetBody, body: UprightBody, newest: Outline, missing: MaskArray, settings: CentreSettings
) -> FloatArray | None:
    """Direction to the camera when part of the outline began to be missing; ``missing``: which tangents are now."""
    if np.count_nonzero(missing) < settings.parted_share * TANGENTS:
        return None
    return _direction(body, newest) if known.short_from is None else known.short_from


def _direction(body: UprightBody, outline: Outline) -> FloatArray:
    """Unit vector from a body to the camera that saw the outline, shape (3,), in base."""
    offset = outline.origin - body.centre
    return offset / np.linalg.norm(offset)


def _turned(body: UprightBody, newest: Outline, before: FloatArray) -> float:
    """Angle by which the line of sight turned since its direction was ``before``, rad."""
    return math.acos(float(np.clip(_direction(body, newest) @ before, -1.0, 1.0)))


def _contradicted(
    known: TargetBody,
    body: UprightBody,
    newest: Outline,
    ray: FloatArray,
    support_height: float,
    settings: CentreSettings,
) -> TargetBody:
    """After a frame that contradicts the body: one may be bad; after several it is elsewhere, or all begins again.

    Args:
        known: what outlines said before.
        body: as it was.
        newest: its outline now.
        ray: direction in base in which it is seen, shape (3,).
        support_height: height of the table in base, m.
        settings: how well it must fit.
    """
    if known.contradictions + 1 < settings.moved_frames:
        return replace(known, contradictions=known.contradictions + 1)
    if ray[2] > -1e-3 or newest.origin[2] < body.centre[2]:  # the ray does not come down to the table
        return TargetBody((newest,))
    point = newest.origin + ray * (body.centre[2] - newest.origin[2]) / ray[2]
    parameters = body.parameters if known.prior is None else known.prior.mean
    prior = moved_body(parameters, point, settings.body)
    found = fit_upright_body((newest,), prior, support_height, settings.body, replace(body, parameters=prior.mean))
    if float(np.median(np.abs(misfit(found, newest, support_height)))) > settings.moved_misfit_px:
        return TargetBody((newest,))
    return TargetBody((newest,), found, prior)


def _is_new_view(outlines: tuple[Outline, ...], T_base_cam: FloatArray, baseline: float) -> bool:
    return not outlines or bool(np.linalg.norm(T_base_cam[:3, 3] - outlines[-1].origin) > baseline)


def _thinned(outlines: tuple[Outline, ...], most: int) -> tuple[Outline, ...]:
    """Fewer than ``most``: the newer half is kept, and every second one of the older half."""
    if len(outlines) < most:
        return outlines
    return outlines[: most // 2 : 2] + outlines[most // 2 :]
