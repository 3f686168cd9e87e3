"""Compiled loops for colour, zero-flow test and evidence map; see ``kernels``."""

from __future__ import annotations

import numpy as np

from fixation_gym.compiled import compiled_fast


@compiled_fast
def test_pixels(information, gradient, cov, residual, usable, question, answers, supported, moving):
    """Zero-flow test of every pixel: see ``pixel_answers`` for the meaning and ``PixelQuestion``.

    Args:
        information: J of the flow, shape (3, h, w).
        gradient: b of the flow, shape (2, h, w).
        cov: J^-1, shape (3, h, w).
        residual: -J^-1 b, shape (2, h, w).
        usable: pixels that may have evidence, shape (h, w).
        question: what to test.
        answers: result, shape (3, h, w): inverse depth, its standard deviation, P(nearer).
        supported: result, shape (h, w): pixels with evidence.
        moving: result, shape (h, w): pixels that move off the epipolar line.
    """
    q, columns = question, question.surface_columns
    own = np.empty(usable.shape[1], np.float32)
    across_noise = q.rotation_noise + q.position_noise * q.warp_inverse_depth * q.warp_inverse_depth
    for row in range(usable.shape[0]):
        g, rise, ok = q.gy[row], q.surface_rows[row], usable[row]
        jxx, jxy, jyy = information[0, row], information[1, row], information[2, row]
        bx, by, u, v = gradient[0, row], gradient[1, row], residual[0, row], residual[1, row]
        cxx, cxy, cyy = cov[0, row], cov[1, row], cov[2, row]
        depth, std, nearer = answers[0, row], answers[1, row], answers[2, row]
        for i in range(usable.shape[1]):
            f = q.gx[i]
            length = max(f * f + g * g, np.float32(1e-12))
            along = max(f * (f * jxx[i] + np.float32(2) * g * jxy[i]) + g * g * jyy[i], np.float32(1e-12))
            d = q.warp_inverse_depth - (f * bx[i] + g * by[i]) / along
            variance = np.float32(1) / along + (q.rotation_noise + q.position_noise * d * d) / length
            std[i] = np.sqrt(variance)
            known = ok[i] and std[i] < q.max_std
            depth[i] = d if known else np.float32(np.nan)
            surface = rise + columns[i]
            extra = q.boundary_variance if surface <= q.boundary else np.float32(0)
            z = (d - max(surface, q.boundary)) / np.sqrt(variance + extra)
            nearer[i] = _normal_distribution(z) if known else np.float32(0.5)
            c = f * v[i] - g * u[i]
            spread = g * (g * cxx[i] - np.float32(2) * f * cxy[i]) + f * f * cyy[i] + across_noise * length
            own[i] = c * c - max(q.moving_gate * spread, q.least_moving * length)
        # In a loop of its own, as mixed widths would keep the one above from being vectorised.
        for i in range(usable.shape[1]):
            supported[row, i] = depth[i] == depth[i]
            moving[row, i] = ok[i] and own[i] > np.float32(0)


@compiled_fast
def _normal_distribution(z):
    """Phi(z) to 2e-7: Abramowitz & Stegun 1964, 7.1.28."""
    x = min(abs(z), np.float32(8)) * np.float32(0.70710678)
    e = np.float32(0.0001520143) + x * (np.float32(0.0002765672) + x * np.float32(0.0000430638))
    e = np.float32(0.0705230784) + x * (np.float32(0.0422820123) + x * (np.float32(0.0092705272) + x * e))
    e = np.float32(1) + x * e
    e *= e
    e *= e
    e *= e
    e = np.float32(0.5) / (e * e)
    return np.float32(1) - e if z > np.float32(0) else e


@compiled_fast
def pooled_evidence(p_nearer, supported, moving, cells):
    """Means over square cells: evidence in front, its square, behind, its square, and the share of pixels seen.

    Args:
        p_nearer: P(nearer), shape (h, w).
        supported: pixels with evidence, shape (h, w).
        moving: pixels that count as certainly near, shape (h, w).
        cells: result, shape (5, n, n) with n <= h and n <= w.
    """
    height, width = p_nearer.shape
    side = cells.shape[1]
    cells[:] = np.float32(0)
    area = np.float32(side * side) / np.float32(height * width)
    line = np.empty((5, side + 1), np.float32)
    front, front_squared, behind, behind_squared, seen = line[0], line[1], line[2], line[3], line[4]
    column_cells, column_shares = _cells_of(side, width)
    row_cells, row_shares = _cells_of(side, height)
    for row in range(height):
        line[:] = np.float32(0)
        evidence, known, own = p_nearer[row], supported[row], moving[row]
        for i in range(width):
            if known[i] or own[i]:
                value = np.float32(1) if own[i] else np.float32(2) * evidence[i] - np.float32(1)
                cell, share = column_cells[i], column_shares[i]
                rest = np.float32(1) - share
                linear, square = (front, front_squared) if value > 0 else (behind, behind_squared)
                size = abs(value)
                linear[cell] += share * size
                linear[cell + 1] += rest * size
                square[cell] += share * size * size
                square[cell + 1] += rest * size * size
                seen[cell] += share
                seen[cell + 1] += rest
        cell, share = row_cells[row], row_shares[row]
        for k in range(5):
            for i in range(side):
                cells[k, cell, i] += area * share * line[k, i]
            if share < 1:
                for i in range(side):
                    cells[k, cell + 1, i] += area * (np.float32(1) - share) * line[k, i]


@compiled_fast
def map_values(cells, least_front, front_weight, least_share, unknown, values):
    """Values 0..255 of the map from pooled evidence; see ``evidence_map``.

    Args:
        cells: means of ``pooled_evidence``, shape (5, n, n).
        least_front: least front evidence in a cell and its neighbours.
        front_weight: of front evidence against evidence behind.
        least_share: least share of a cell's pixels that must have evidence.
        unknown: value of cells without evidence.
        values: result, shape (n, n), uint8.
    """
    side = cells.shape[1]
    line = np.zeros(side + 2, np.float32)
    for row in range(side):
        above, below = max(row - 1, 0), min(row + 1, side - 1)
        for i in range(side):
            line[i + 1] = cells[0, row, i]
            if above < row:
                line[i + 1] += cells[0, above, i]
            if below > row:
                line[i + 1] += cells[0, below, i]
        front, front_squared, behind, behind_squared = cells[0, row], cells[1, row], cells[2, row], cells[3, row]
        for i in range(side):
            weight = front_weight if line[i] + line[i + 1] + line[i + 2] >= least_front else np.float32(0)
            evidence = weight * front[i] + behind[i]
            known = cells[4, row, i] >= least_share and evidence > np.float32(0.5) * least_share
            decided = (weight * front_squared[i] - behind_squared[i]) / max(evidence, np.float32(1e-6))
            values[row, i] = np.uint8(np.rint(np.float32(127.5) + np.float32(127.5) * decided)) if known else unknown


@compiled_fast
def _cells_of(cells, pixels):
    """First cell that each pixel of a row lies in and the share of the pixel in it; the rest lies in the next."""
    first, shares = np.empty(pixels, np.int64), np.empty(pixels, np.float32)
    for i in range(pixels):
        first[i] = i * cells // pixels
        rest = (first[i] + 1) * pixels - i * cells  # up to the end of the cell, in units of 1 / cells px
        shares[i] = np.float32(min(rest, cells)) / np.float32(cells)
    return first, shares


@compiled_fast
def in_colour_range(rgb, start, step, least_spread, hue_scale, hue_in_range, out):
    """Test pixels of an image for hue, saturation and brightness, with the integer arithmetic of OpenCV's RGB2HSV.

    Args:
        rgb: image of shape (H, W, 3), uint8.
        start: row and column of the first pixel to test.
        step: only every such pixel is tested, along rows and columns.
        least_spread: least difference of largest and smallest channel by the largest, shape (256,); 256 for never.
        hue_scale: factor of hue by that difference, shape (256,).
        hue_in_range: whether a hue, in units of 2 degrees, is in the range, shape (181,).
        out: result, 1 or 0, shape (h, w).
    """
    for row in range(out.shape[0]):
        line, result = rgb[start[0] + row * step], out[row]
        for column in range(out.shape[1]):
            pixel = line[start[1] + column * step]
            r, g, b = np.int32(pixel[0]), np.int32(pixel[1]), np.int32(pixel[2])
            value = max(r, g, b)
            spread = value - min(r, g, b)
            result[column] = 0
            if spread >= least_spread[value]:
                if value == r:
                    hue = g - b
                elif value == g:
                    hue = b - r + 2 * spread
                else:
                    hue = r - g + 4 * spread
                hue = (hue * hue_scale[spread] + 2048) >> 12
                result[column] = 1 if hue_in_range[hue + 180 if hue < 0 else hue] else 0
