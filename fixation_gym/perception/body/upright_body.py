"""A body that stands upright on a table, fitted to the outlines that a moving camera sees of it.

The centroid that is tracked is that of the visible surface: from steeply above the top's, a centimetre or more above
the centre of the body. An outline tells more. Each of its tangents spans a plane with the camera centre that touches
the body, and planes from many sides, with the table below, leave little choice. A convex body is what its support
function says, the distance from the centre to the touching plane with normal n. For half sizes a, b, c it is here

    g(n) = ((A^p + B^p)^(q/p) + C^q)^(1/q),   A = a |n_x|, B = b |n_y|, C = c |n_z|  (x, y turned by the yaw)

which is exact for boxes (p = q = 1), elliptic cylinders (2, 1) and ellipsoids (2, 2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.types import FloatArray, MaskArray

TANGENTS = 24
"""Tangents taken of every outline."""


@dataclass(frozen=True, slots=True)
class BodySettings:
    """Noise of outlines, and what bodies to expect before any was seen."""

    outline_std_px: float = 0.6
    """Error of an outline, px."""
    half_size_m: float = 0.027
    """Half size along each axis to expect, m."""
    log_size_std: float = 0.5
    """Standard deviation of its logarithm."""
    moved_log_size_std: float = 0.05
    """The same of a body whose size is known and that was moved."""
    position_std_m: float = 0.03
    """How far the centre may be from where it is expected, m."""
    model_std_m: float = 1e-3
    """Error of the centre because no body is exactly of this kind, m."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Tangents of one outline as planes through the camera centre; n of them."""

    origin: FloatArray
    """Camera centre in base, shape (3,), m."""
    normals: FloatArray
    """Outward normals in base, shape (n, 3), scaled so that n . (X - origin) / depth is in normalised coordinates."""
    depth: float
    """Depth of the body along the optical axis, m."""
    pixel: float
    """Size of a pixel in normalised coordinates."""


@dataclass(frozen=True, slots=True, eq=False)
class UprightBody:
    """The fitted body."""

    centre: FloatArray
    """In base, shape (3,), m."""
    centre_cov: FloatArray
    """Covariance of ``centre``, shape (3, 3), m^2."""
    parameters: FloatArray
    """x, y, yaw, logarithms of the half sizes a, b, c, and arcsines of 2 p - 3 and 2 q - 3, shape (8,)."""

    @property
    def half_sizes(self) -> FloatArray:
        """a, b, c, shape (3,), m."""
        return np.exp(self.parameters[3:6])

    def reach(self, normal: FloatArray) -> float:
        """Distance from the centre to the plane with this unit normal, shape (3,) in base, that touches the body, m."""
        return float(_support(self.parameters, normal[None])[0])

    def widths(self, axes: FloatArray) -> FloatArray:
        """How wide the body is along axes, unit vectors of shape (n, 3) in base; shape (n,), m."""
        return 2.0 * _support(self.parameters, axes)

    def depth(self, T_base_cam: FloatArray) -> tuple[float, float]:
        """Depth of the centre along a camera's optical axis and its standard deviation, m."""
        axis = T_base_cam[:3, 2]
        return float(axis @ (self.centre - T_base_cam[:3, 3])), float(np.sqrt(axis @ self.centre_cov @ axis))


@dataclass(frozen=True, slots=True, eq=False)
class BodyPrior:
    """What is expected of a body's parameters: mean and standard deviation, shape (8,) each."""

    mean: FloatArray
    std: FloatArray


def unknown_body(point: FloatArray, settings: BodySettings) -> BodyPrior:
    """Prior of a body of which nothing is known but about where it is in base, shape (3,), m."""
    sizes = [np.log(settings.half_size_m)] * 3
    stds = [settings.position_std_m] * 2 + [1.0] + [settings.log_size_std] * 3 + [2.0, 2.0]
    return BodyPrior(np.array([point[0], point[1], 0.0, *sizes, 0.0, 0.0]), np.array(stds))


def moved_body(parameters: FloatArray, point: FloatArray, settings: BodySettings) -> BodyPrior:
    """Prior of a known body that was moved to about this place in base, shape (3,), m."""
    stds = [settings.position_std_m] * 2 + [1.0] + [settings.moved_log_size_std] * 3 + [0.2, 0.2]
    return BodyPrior(np.array([point[0], point[1], *parameters[2:]]), np.array(stds))


def outline_of(mask: MaskArray, intrinsics: Intrinsics, T_base_cam: FloatArray, depth: float) -> Outline:
    """Outline of a mask, without tangents at the image border.

    Args:
        mask: shape (H, W), not empty.
        intrinsics: of the image; pixels are taken for square.
        T_base_cam: camera pose in base, shape (4, 4).
        depth: about how far the body is, m.
    """
    contours, _ = cv2.findContours(mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    hull = cv2.convexHull(np.concatenate(contours)).reshape(-1, 2).astype(np.float64)
    along = intrinsics.normalise(hull) @ _DIRECTIONS.T
    touching = hull[along.argmax(axis=0)]
    inside = np.all((touching > 0) & (touching < [intrinsics.width - 1, intrinsics.height - 1]), axis=1)
    reach = along.max(axis=0)[inside] + 0.5 / intrinsics.fx
    normals = np.column_stack([_DIRECTIONS[inside], -reach]) @ T_base_cam[:3, :3].T
    return Outline(T_base_cam[:3, 3].copy(), normals, depth, 1.0 / intrinsics.fx)


def misfit(body: UprightBody, outline: Outline, support_height: float) -> FloatArray:
    """By how much each tangent of the body lies outside the outline's, shape (n,), px."""
    planes = _Planes.of([outline])
    return planes.misfit(body.parameters, support_height) / outline.pixel


def fit_upright_body(
    outlines: Sequence[Outline],
    prior: BodyPrior,
    support_height: float,
    settings: BodySettings,
    start: UprightBody | None = None,
) -> UprightBody:
    """Most probable body (robust, since parts of an outline may be covered).

    Args:
        outlines: at least one.
        prior: what is expected.
        support_height: height of the table in base, m.
        settings: noise.
        start: an earlier fit to begin from; None tries several yaws about the expected one.
    """
    from scipy.optimize import least_squares  # half a second to import

    planes = _Planes.of(outlines)
    noise = planes.pixel * settings.outline_std_px

    def residuals(parameters: FloatArray) -> FloatArray:
        seen = planes.misfit(parameters, support_height) / noise
        return np.concatenate([seen, (parameters - prior.mean) / prior.std])

    def jacobian(parameters: FloatArray) -> FloatArray:
        return np.concatenate([planes.jacobian(parameters) / noise[:, None], np.diag(1.0 / prior.std)])

    def solution(first: FloatArray, evaluations: int):
        return least_squares(
            residuals,
            first,
            jacobian,  # pyright: ignore[reportArgumentType]  # SciPy takes functions, too
            x_scale=prior.std,
            loss="soft_l1",
            f_scale=2.0,
            ftol=1e-4,
            xtol=1e-4,
            max_nfev=evaluations,
        )

    if start is not None:
        found = solution(start.parameters, 12)
    else:
        turned = [prior.mean + np.eye(8)[2] * yaw for yaw in (0.0, np.pi / 6, np.pi / 3)]
        found = min((solution(first, 60) for first in turned), key=lambda result: result.cost)
    return _body(found.x, found.jac, support_height, settings)


def _body(parameters: FloatArray, jacobian: FloatArray, support_height: float, settings: BodySettings) -> UprightBody:
    cov = np.linalg.inv(jacobian.T @ jacobian)
    height = float(np.exp(parameters[5]))
    by_parameters = np.zeros((3, 8))
    by_parameters[0, 0] = by_parameters[1, 1] = 1.0
    by_parameters[2, 5] = height
    centre = np.array([parameters[0], parameters[1], support_height + height])
    centre_cov = by_parameters @ cov @ by_parameters.T + settings.model_std_m**2 * np.eye(3)
    return UprightBody(centre, centre_cov, parameters)


@dataclass(frozen=True, slots=True, eq=False)
class _Planes:
    """Tangents of several outlines in one array each; n in all."""

    origin: FloatArray
    normals: FloatArray
    depth: FloatArray
    pixel: FloatArray

    @classmethod
    def of(cls, outlines: Sequence[Outline]) -> _Planes:
        counts = [len(outline.normals) for outline in outlines]
        return cls(
            np.repeat([outline.origin for outline in outlines], counts, axis=0),
            np.concatenate([outline.normals for outline in outlines]),
            np.repeat([outline.depth for outline in outlines], counts),
            np.repeat([outline.pixel for outline in outlines], counts),
        )

    def misfit(self, parameters: FloatArray, support_height: float) -> FloatArray:
        """By how much each tangent of the body lies outside the outline's, shape (n,), normalised coordinates."""
        x, y = parameters[:2]
        offset = np.array([x, y, support_height + np.exp(parameters[5])]) - self.origin
        reach = _support(parameters, self.normals)
        return (np.einsum("ij,ij->i", self.normals, offset) + reach) / self.depth

    def jacobian(self, parameters: FloatArray) -> FloatArray:
        """Derivative of ``misfit``, shape (n, 8)."""
        result = _support_jacobian(parameters, self.normals)
        result[:, :2] = self.normals[:, :2]
        result[:, 5] += self.normals[:, 2] * np.exp(parameters[5])  # half as high again as it stands
        return result / self.depth[:, None]


def _parts(parameters: FloatArray, normals: FloatArray) -> tuple[FloatArray, ...]:
    """A, B, C, the two parts of the normals along the body's axes, and the exponents p and q."""
    a, b, c = np.exp(parameters[3:6])
    p, q = 1.5 + 0.5 * np.sin(parameters[6:])  # both ends can be reached
    cos, sin = np.cos(parameters[2]), np.sin(parameters[2])
    along = cos * normals[:, 0] + sin * normals[:, 1]
    across = cos * normals[:, 1] - sin * normals[:, 0]
    lengths = (np.abs(part) + _TINY for part in (along, across, normals[:, 2]))
    A, B, C = (size * length for size, length in zip((a, b, c), lengths, strict=True))
    return A, B, C, along, across, p, q


def _support(parameters: FloatArray, normals: FloatArray) -> FloatArray:
    """Support function g of the body about its centre, for normals of shape (n, 3), m."""
    A, B, C, _, _, p, q = _parts(parameters, normals)
    return ((A**p + B**p) ** (q / p) + C**q) ** (1.0 / q)


def _support_jacobian(parameters: FloatArray, normals: FloatArray) -> FloatArray:
    """Derivative of g by the parameters, shape (n, 8); it does not depend on x and y."""
    A, B, C, along, across, p, q = _parts(parameters, normals)
    flat = (A**p + B**p) ** (1.0 / p)
    g = (flat**q + C**q) ** (1.0 / q)
    by_flat, by_C = (flat / g) ** (q - 1.0), (C / g) ** (q - 1.0)
    by_A, by_B = by_flat * (A / flat) ** (p - 1.0), by_flat * (B / flat) ** (p - 1.0)
    share, upright = (A / flat) ** p, (flat / g) ** q
    by_p = by_flat * flat / p * (share * np.log(A / flat) + (1.0 - share) * np.log(B / flat))
    by_q = g / q * (upright * np.log(flat / g) + (1.0 - upright) * np.log(C / g))
    turning = by_A * A * across / (along + np.copysign(_TINY, along)) - by_B * B * along / (
        across + np.copysign(_TINY, across)
    )
    slope_p, slope_q = 0.5 * np.cos(parameters[6:])
    zero = np.zeros(len(g))
    columns = [zero, zero, turning, by_A * A, by_B * B, by_C * C, by_p * slope_p, by_q * slope_q]
    return np.stack(columns, axis=1)


_TINY = 1e-9
"""Keeps logarithms finite."""
_ANGLES = 2.0 * np.pi * np.arange(TANGENTS) / TANGENTS
_DIRECTIONS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
