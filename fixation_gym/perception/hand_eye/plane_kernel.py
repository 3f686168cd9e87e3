"""Compiled loop over the pixels of a flow: how well they fit a plane, and how that changes with the unknowns."""

from __future__ import annotations

import numpy as np

from fixation_gym.compiled import compiled_fast

UNKNOWNS = 14
"""Hand-eye translation (3) and rotation (3), height, gain of the flow, errors of the velocity (3) and the rate (3)."""
HEIGHT, GAIN = 6, 7
"""Where the height and the gain are among them."""


@compiled_fast
def plane_equations(information, gradient, usable, x, y, view, jacobian, warp, scale, gain, bounds, sums):
    """Add up the normal equations of all pixels that may lie on a plane.

    The flow beyond the warp is expected to be ``gain`` times d A v + B w less what the warp took out, where the inverse
    depth d of the plane is m . (x, y, 1). What ``information`` and ``gradient`` say is not inverted: -(b + J p) is the
    misfit in information form.

    Args:
        information: J of the flow, shape (3, h, w).
        gradient: b of the flow, shape (2, h, w).
        usable: pixels to look at, shape (h, w).
        x: normalised coordinates of the columns, shape (w,).
        y: the same of the rows, shape (h,).
        view: m, v and w of the true camera, shape (9,).
        jacobian: their derivatives, shape (9, ``UNKNOWNS``).
        warp: inverse depth and twist that the warp took out, shape (7,).
        scale: px and intervals of the grid per unit of flow, shape (2,).
        gain: of the flow.
        bounds: step between pixels; largest height over the plane and its largest standard deviation, m; thickness of
            the plane, m; pixels that share their evidence.
        sums: result: normal matrix in the first ``UNKNOWNS`` rows, vector in the next, then the number of pixels and
            the sum of their heights over the plane without sign, shape (``UNKNOWNS`` + 2, ``UNKNOWNS``).
    """
    step, highest, least_sure, thickness, shared = bounds
    stride = int(step)
    by = np.empty((2, UNKNOWNS))
    jby = np.empty((2, UNKNOWNS))
    for row in range(stride // 2, usable.shape[0], stride):
        for column in range(stride // 2, usable.shape[1], stride):
            if not usable[row, column]:
                continue
            px, py = x[column], y[row]
            depth = view[0] * px + view[1] * py + view[2]
            gx, gy = px * view[5] - view[3], py * view[5] - view[4]
            wx, wy = px * warp[3] - warp[1], py * warp[3] - warp[2]
            fx = depth * gx - warp[0] * wx
            fx += px * py * (view[6] - warp[4]) - (1.0 + px * px) * (view[7] - warp[5]) + py * (view[8] - warp[6])
            fy = depth * gy - warp[0] * wy
            fy += (1.0 + py * py) * (view[6] - warp[4]) - px * py * (view[7] - warp[5]) - px * (view[8] - warp[6])
            expected_x, expected_y = gain * scale[0] * fx, gain * scale[1] * fy
            jxx, jxy, jyy = information[0, row, column], information[1, row, column], information[2, row, column]
            misfit_x = -(gradient[0, row, column] + jxx * expected_x + jxy * expected_y)
            misfit_y = -(gradient[1, row, column] + jxy * expected_x + jyy * expected_y)
            for k in range(UNKNOWNS):
                d = jacobian[0, k] * px + jacobian[1, k] * py + jacobian[2, k]
                a, b, c = jacobian[6, k], jacobian[7, k], jacobian[8, k]
                along_x = d * gx + depth * (px * jacobian[5, k] - jacobian[3, k])
                along_x += px * py * a - (1.0 + px * px) * b + py * c
                along_y = d * gy + depth * (py * jacobian[5, k] - jacobian[4, k])
                along_y += (1.0 + py * py) * a - px * py * b - px * c
                by[0, k], by[1, k] = gain * scale[0] * along_x, gain * scale[1] * along_y
            by[0, GAIN], by[1, GAIN] = scale[0] * fx, scale[1] * fy
            for k in range(UNKNOWNS):
                jby[0, k] = jxx * by[0, k] + jxy * by[1, k]
                jby[1, k] = jxy * by[0, k] + jyy * by[1, k]
            known = by[0, HEIGHT] * jby[0, HEIGHT] + by[1, HEIGHT] * jby[1, HEIGHT]
            if not known > 1.0 / (least_sure * least_sure):
                continue
            rise = (by[0, HEIGHT] * misfit_x + by[1, HEIGHT] * misfit_y) / known
            if not abs(rise) < highest:
                continue
            variance = 1.0 / known + thickness * thickness
            weight = 1.0 / (known * variance * (1.0 + rise * rise / (4.0 * variance))) / shared
            for k in range(UNKNOWNS):
                sums[UNKNOWNS, k] += weight * (by[0, k] * misfit_x + by[1, k] * misfit_y)
                for m in range(k + 1):
                    sums[k, m] += weight * (by[0, m] * jby[0, k] + by[1, m] * jby[1, k])
            sums[UNKNOWNS + 1, 0] += 1.0
            sums[UNKNOWNS + 1, 1] += abs(rise)
