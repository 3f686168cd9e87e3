"""Compiled loop over the pixels of a flow: how well they fit a plane that a camera moves past, and what would help."""

from __future__ import annotations

import numpy as np

from fixation_gym.compiled import compiled_fast

COLUMNS = 10
"""What the flow of a plane depends on: the plane m (3), the camera's velocity v (3) and rate w (3), the gain."""


@compiled_fast
def plane_equations(information, gradient, usable, x, y, view, warp, scale, gain, bounds, sums):
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
        view: m, v and w of the camera, shape (9,), and how far it is from the plane, m; shape (10,).
        warp: inverse depth and twist that the warp took out, shape (7,).
        scale: px and intervals of the grid per unit of flow, shape (2,).
        gain: of the flow.
        bounds: step between pixels; largest height over the plane and its largest standard deviation, m; thickness of
            the plane, m; pixels that share their evidence.
        sums: result: lower half of the normal matrix in the first ``COLUMNS`` rows, vector in the next, then the number
            of pixels and the sum of their heights over the plane without sign, shape (``COLUMNS`` + 2, ``COLUMNS``).
    """
    step, highest, least_sure, thickness, shared = bounds
    stride = int(step)
    ax, ay = gain * scale[0], gain * scale[1]
    by = np.zeros((2, COLUMNS))
    jby = np.empty((2, COLUMNS))
    for row in range(stride // 2, usable.shape[0], stride):
        py = y[row]
        for column in range(stride // 2, usable.shape[1], stride):
            if not usable[row, column]:
                continue
            px = x[column]
            depth = view[0] * px + view[1] * py + view[2]
            gx, gy = px * view[5] - view[3], py * view[5] - view[4]
            jxx, jxy, jyy = information[0, row, column], information[1, row, column], information[2, row, column]
            # By the height of the plane: m becomes shorter as the distance grows.
            lift = -depth / view[9]
            hx, hy = lift * ax * gx, lift * ay * gy
            known = hx * (jxx * hx + jxy * hy) + hy * (jxy * hx + jyy * hy)
            if not known > 1.0 / (least_sure * least_sure):
                continue
            wx, wy = px * warp[3] - warp[1], py * warp[3] - warp[2]
            fx = depth * gx - warp[0] * wx
            fx += px * py * (view[6] - warp[4]) - (1.0 + px * px) * (view[7] - warp[5]) + py * (view[8] - warp[6])
            fy = depth * gy - warp[0] * wy
            fy += (1.0 + py * py) * (view[6] - warp[4]) - px * py * (view[7] - warp[5]) - px * (view[8] - warp[6])
            misfit_x = -(gradient[0, row, column] + jxx * ax * fx + jxy * ay * fy)
            misfit_y = -(gradient[1, row, column] + jxy * ax * fx + jyy * ay * fy)
            rise = (hx * misfit_x + hy * misfit_y) / known
            if not abs(rise) < highest:
                continue
            variance = 1.0 / known + thickness * thickness
            weight = 1.0 / (known * variance * (1.0 + rise * rise / (4.0 * variance))) / shared
            by[0, 0], by[0, 1], by[0, 2] = ax * gx * px, ax * gx * py, ax * gx
            by[1, 0], by[1, 1], by[1, 2] = ay * gy * px, ay * gy * py, ay * gy
            by[0, 3], by[1, 4] = -ax * depth, -ay * depth
            by[0, 5], by[1, 5] = ax * depth * px, ay * depth * py
            by[0, 6], by[1, 6] = ax * px * py, ay * (1.0 + py * py)
            by[0, 7], by[1, 7] = -ax * (1.0 + px * px), -ay * px * py
            by[0, 8], by[1, 8] = ax * py, -ay * px
            by[0, 9], by[1, 9] = scale[0] * fx, scale[1] * fy
            for k in range(COLUMNS):
                jby[0, k] = weight * (jxx * by[0, k] + jxy * by[1, k])
                jby[1, k] = weight * (jxy * by[0, k] + jyy * by[1, k])
                sums[COLUMNS, k] += weight * (by[0, k] * misfit_x + by[1, k] * misfit_y)
                for m in range(k + 1):
                    sums[k, m] += by[0, m] * jby[0, k] + by[1, m] * jby[1, k]
            sums[COLUMNS + 1, 0] += 1.0
            sums[COLUMNS + 1, 1] += abs(rise)
