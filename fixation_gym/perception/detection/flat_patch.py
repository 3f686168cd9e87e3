"""Follow a pattern that its colours do not tell from what is around it, as a plane that the camera's motion moves.

Between two views of a plane a homography K (R + t m^T) K^-1 maps pixels. The camera's motion R, t is known, so only the
three numbers m of the plane are not. Until they are, distances are tried one by one (plane sweep, Collins 1996), and
the best few are refined to a full homography by their correlation (ECC, Evangelidis & Psarakis 2008), from which the
plane follows. Pictures may be as far apart as stills. Value in, value out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fixation_gym.geometry.rigid import inverse
from fixation_gym.perception.detection.detector import Sighting
from fixation_gym.perception.detection.picture import Picture
from fixation_gym.types import FloatArray, ImageArray, MaskArray

_SIDE = 64
"""Longer side of the patch that is compared, px ..."""
_MARGIN = 0.3
"""... with this share of the target around it, which tells where a pattern that repeats itself ends."""
_INVERSE_DEPTHS = np.geomspace(0.3, 8.0, 60)
"""Distances that are tried, 1/m."""
_TRIED = 4
"""So many of them are refined ..."""
_APART = 0.15
"""... that differ by this in the logarithm."""
_LEAST_IN_VIEW = 0.5
"""Share of the patch that must be in the image."""
_SAME, _SURE = 0.6, 0.8
"""Correlation from which on it is the same thing, and nothing better is looked for."""
_LEAST_BASELINE = 0.02
"""The plane is taken from views that are this far apart, as a share of its distance."""
_POINT_STD_PX = 0.3
"""Noise of a place that a refined homography gives, px."""
_POSE_PX = 6.0
"""A pose may be wrong by so many px at 320 columns; a repeated pattern found one period beside is farther off."""
_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-3)

Homography = NDArray[np.float64]
"""Shape (3, 3): maps pixels (u, v, 1) up to scale."""
Grey = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class FlatPatch:
    """What is known of a flat textured thing."""

    mask: MaskArray
    """Its pixels in the first image."""
    point: FloatArray
    """Their middle, px of the first image, shape (2,)."""
    patch: Grey
    """The thing and a margin in the first image, small."""
    to_first: Homography
    """From pixels of the patch to those of the first image."""
    T_base_first: FloatArray
    """Camera pose of the first image, shape (4, 4)."""
    plane: FloatArray | None = None
    """m: the unit normal in the first camera divided by the distance, 1/m, shape (3,); None while it is not known."""
    baseline: float = 0.0
    """Share of its distance by which the views were apart from which the plane was taken."""

    def followed(self, picture: Picture) -> tuple[FlatPatch, Sighting | MaskArray]:
        """What is known of it after an image, and its pixels, shape (h, w); none where it is not seen.

        Where it is expected is not asked: the plane and the pose of the camera say that better.
        """
        homography = self._found(picture)
        if homography is None:
            return self, np.zeros(self.mask.shape, np.bool_)
        size = self.mask.shape[::-1]
        mask = cv2.warpPerspective(self.mask.view(np.uint8) * 255, homography, size, flags=cv2.INTER_LINEAR) > 127
        plane, baseline = self._plane(picture, homography)
        known = self
        if baseline > max(self.baseline, _LEAST_BASELINE):
            known = replace(self, plane=plane, baseline=baseline)
        point = picture.camera.normalise(_mapped(homography, self.point))
        return known, Sighting(mask, point, _POINT_STD_PX / picture.camera.fx)

    def _found(self, picture: Picture) -> Homography | None:
        """From the first image to this one; None if it is not seen."""
        grey = _blurred(picture, self.to_first)
        if self.plane is not None:
            found = self._refined(grey, self._moved(picture, self.plane))
            if found[0] >= _SURE:
                return found[1]
        tried = [self._compared(grey, self._moved(picture, np.array([0.0, 0.0, rho]))) for rho in _INVERSE_DEPTHS]
        best, homography, used = _SAME, None, []
        for k in sorted(range(len(tried)), key=lambda k: -tried[k][0]):
            rho = math.log(_INVERSE_DEPTHS[k])
            if tried[k][0] <= 0.0 or len(used) == _TRIED:
                break
            if any(abs(rho - other) < _APART for other in used):
                continue
            used.append(rho)
            correlation, refined = self._refined(grey, tried[k][1])
            if correlation > best and self._explained(picture, refined):
                best, homography = correlation, refined
        return homography

    def _moved(self, picture: Picture, plane: FloatArray) -> Homography:
        """From the first image to this one, for a plane."""
        T = inverse(picture.T_base_cam) @ self.T_base_first
        K = picture.camera.matrix
        return K @ (T[:3, :3] + np.outer(T[:3, 3], plane)) @ np.linalg.inv(K)

    def _at(self, grey: Grey, homography: Homography) -> tuple[Grey, ImageArray]:
        """The image where a homography says that the patch is, and which of its pixels are in the image."""
        to_now, size = homography @ self.to_first, self.patch.shape[::-1]
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        part = cv2.warpPerspective(grey, to_now, size, flags=flags, borderValue=-1.0)
        behind = (to_now[2] @ _corners(self.patch.shape)).min() <= 0.0
        inside = np.zeros(self.patch.shape, np.uint8) if behind else (part >= 0.0).astype(np.uint8)
        return np.asarray(part, np.float32), inside

    def _compared(self, grey: Grey, homography: Homography) -> tuple[float, Homography]:
        """Correlation of the patch with an image where a homography says that it is."""
        part, inside = self._at(grey, homography)
        if inside.mean() < _LEAST_IN_VIEW:
            return -1.0, homography
        first, now = (image[inside > 0].astype(np.float64) for image in (self.patch, part))
        first, now = first - first.mean(), now - now.mean()
        return float(first @ now / max(1e-9, math.sqrt((first @ first) * (now @ now)))), homography

    def _refined(self, grey: Grey, homography: Homography) -> tuple[float, Homography]:
        """The homography near by with the highest correlation, and that."""
        part, inside = self._at(grey, homography)
        if inside.mean() < _LEAST_IN_VIEW:
            return -1.0, homography
        ecc: Any = cv2.findTransformECC
        try:
            left = ecc(self.patch, part, np.eye(3, dtype=np.float32), cv2.MOTION_HOMOGRAPHY, _STOP, inside, 3)[1]
        except cv2.error:  # it did not converge
            return -1.0, homography
        return self._compared(grey, homography @ self.to_first @ left @ np.linalg.inv(self.to_first))

    def _explained(self, picture: Picture, homography: Homography) -> bool:
        """Whether some plane explains where a homography puts the thing, but for errors of the pose."""
        plane, _ = self._plane(picture, homography)
        corners = self.to_first @ _corners(self.patch.shape)
        by_plane, seen = (H @ corners for H in (self._moved(picture, plane), homography))
        off = np.linalg.norm(by_plane[:2] / by_plane[2] - seen[:2] / seen[2], axis=0)
        return bool(np.max(off) < _POSE_PX * picture.camera.width / 320)

    def _plane(self, picture: Picture, homography: Homography) -> tuple[FloatArray, float]:
        """The plane that explains a homography best, and how far apart the views were, as a share of its distance."""
        T, K = inverse(picture.T_base_cam) @ self.T_base_first, picture.camera.matrix
        seen = np.linalg.inv(K) @ homography @ K
        points = np.linalg.inv(K) @ self.to_first @ _corners(self.patch.shape)
        rotated, mapped = T[:3, :3] @ points, seen @ points
        mapped = mapped / mapped[2]
        # mapped x (R p + t m^T p) = 0 where the homography is known, at the thing.
        rows = np.cross(mapped.T, T[:3, 3])[:, :, None] * points.T[:, None, :]
        plane, *_ = np.linalg.lstsq(rows.reshape(-1, 3), -np.cross(mapped.T, rotated.T).ravel(), rcond=None)
        middle = points.mean(axis=1)
        return plane, float(np.linalg.norm(T[:3, 3])) * max(0.0, float(plane @ middle))


def first_patch(picture: Picture, mask: MaskArray) -> FlatPatch:
    """What one image shows of a thing with these pixels, at least one."""
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    x, y = left - _MARGIN * width, top - _MARGIN * height
    columns, rows = (1.0 + 2.0 * _MARGIN) * width, (1.0 + 2.0 * _MARGIN) * height
    step = max(columns, rows) / _SIDE
    size = max(8, round(columns / step)), max(8, round(rows / step))
    to_first = np.array([[step, 0.0, x], [0.0, step, y], [0.0, 0.0, 1.0]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    patch = cv2.warpPerspective(
        _blurred(picture, to_first), to_first, size, flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
    middle = np.array([left + 0.5 * (width - 1), top + 0.5 * (height - 1)])
    return FlatPatch(mask, middle, np.asarray(patch, np.float32), to_first, picture.T_base_cam)


def _blurred(picture: Picture, to_first: Homography) -> Grey:
    """The image without what is finer than the pixels of the patch."""
    grey = cv2.cvtColor(picture.rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), max(0.3, 0.5 * to_first[0, 0])), np.float32)


def _mapped(homography: Homography, pixel: FloatArray) -> FloatArray:
    x, y, scale = homography @ np.append(pixel, 1.0)
    return np.array([x, y]) / scale


def _corners(shape: tuple[int, int]) -> FloatArray:
    """Corners of an image as pixels (u, v, 1), shape (3, 4)."""
    height, width = shape
    return np.array([[0.0, width - 1, width - 1, 0.0], [0.0, 0.0, height - 1, height - 1], [1.0, 1.0, 1.0, 1.0]])
