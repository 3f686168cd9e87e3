"""Compiled loops for the flow.

Arrays are filled by loops: an assignment of an array to a part of another one would take numba five seconds, which
compile the message about shapes that do not fit.
"""

from __future__ import annotations

import numpy as np

from fixation_gym.compiled import compiled_fast

WINDOW = 5
"""Side of the square over which ``window_sums`` pools gradients, px of the flow grid."""


@compiled_fast
def _rows_around(image, row):
    """The row, the two above and the two below; the border is repeated."""
    last = image.shape[0] - 1
    return (
        image[max(row - 2, 0)],
        image[max(row - 1, 0)],
        image[row],
        image[min(row + 1, last)],
        image[min(row + 2, last)],
    )


@compiled_fast
def _repeat_border(line):
    """Fill the two border pixels at each end of a line."""
    line[0] = line[1] = line[2]
    line[-1] = line[-2] = line[-3]


@compiled_fast
def _cell_weights(pixels):
    """Weights of pixels 2 i, 2 i + 1 and 2 i + 2 in cell i of a grid of half the size, shape (3, pixels // 2); sum 2.

    Cells are as wide as 2 pixels, or a little wider where the pixels are odd in number.
    """
    cells = pixels // 2
    weights, whole = np.empty((3, cells), np.float32), np.float32(2 * cells / pixels)
    for i in range(cells):
        # The part of pixel 2 i that lies in cell i - 1, and of pixel 2 i + 2 in cell i.
        before, after = pixels % 2 * i / cells, pixels % 2 * (i + 1) / cells
        weights[0, i], weights[1, i] = np.float32(1 - before) * whole, whole
        weights[2, i] = np.float32(after) * whole
    return weights


@compiled_fast
def _add_products(gradients, keep, own, products):
    """Add what a row gives to ``keep`` times what is there.

    Few arrays a loop: with all in one, compilers do not use vector instructions, and it takes four times as long.

    Args:
        gradients: of the row by x, by y, by time (halved), and their weight, shape (4, W).
        keep: factor of what is there.
        own: energy of the spatial derivatives of noise.
        products: as in ``pooled_products``, shape (10, W); changed in place.
    """
    gx, gy, gt, w = gradients[0], gradients[1], gradients[2], gradients[3]
    xx, xy, yy, xt, yt = products[0], products[1], products[2], products[3], products[4]
    sx, sy, st, sw, tt = products[5], products[6], products[7], products[8], products[9]
    width = gx.size
    for i in range(width):
        xx[i] = keep * xx[i] + w[i] * (gx[i] * gx[i] - own)
        xy[i] = keep * xy[i] + w[i] * gx[i] * gy[i]
        yy[i] = keep * yy[i] + w[i] * (gy[i] * gy[i] - own)
    for i in range(width):
        wt = w[i] * gt[i]
        xt[i] = keep * xt[i] + gx[i] * wt
        yt[i] = keep * yt[i] + gy[i] * wt
        tt[i] = keep * tt[i] + gt[i] * wt
    for i in range(width):
        sx[i] = keep * sx[i] + w[i] * gx[i]
        sy[i] = keep * sy[i] + w[i] * gy[i]
        st[i] = keep * st[i] + w[i] * gt[i]
        sw[i] = keep * sw[i] + w[i]


@compiled_fast
def pooled_products(smooth, change, prefilter, derivative, noise, pooled):
    """Means over 2 x 2 pixels: weighted products xx, xy, yy, xt, yt, weighted gradients x, y, t, the weight, and tt.

    Four pixels make one of the grid, whose gradient per px is twice that of the frame: a factor 16 for J, put into the
    weight. For b it is 8, so the temporal derivative comes halved.

    Args:
        smooth: frames averaged over time, shape (H, W).
        change: their derivative by time, shape (H, W).
        prefilter: 5 symmetric taps.
        derivative: 5 antisymmetric taps.
        noise: variances of motion and of the temporal derivative, energy of the spatial derivatives of noise.
        pooled: result, shape (10, H // 2, W // 2).
    """
    height, width = smooth.shape
    model, temporal, own = noise[0] / np.float32(16), noise[1] / np.float32(16), noise[2]
    p0, p1, p2, d0, d1 = prefilter[0], prefilter[1], prefilter[2], derivative[3], derivative[4]
    lines = np.empty((3, width + 4), np.float32)
    s, y, t = lines[0], lines[1], lines[2]  # filtered along the column: smoothed, by y, by time
    gradients = np.empty((4, width), np.float32)
    gx, gy, gt, w = gradients[0], gradients[1], gradients[2], gradients[3]  # by x, y, time (halved); weight
    products = np.zeros((10, width), np.float32)
    row_weights, column_weights = _cell_weights(height), _cell_weights(width)
    odd = height % 2 or width % 2
    for cell in range(height // 2):
        for part in range(2 + height % 2):
            row = 2 * cell + part
            a, b, c, d, e = _rows_around(smooth, row)
            for i in range(width):
                s[i + 2] = p2 * c[i] + p1 * (b[i] + d[i]) + p0 * (a[i] + e[i])
                y[i + 2] = d0 * (d[i] - b[i]) + d1 * (e[i] - a[i])
            a, b, c, d, e = _rows_around(change, row)
            for i in range(width):
                t[i + 2] = p2 * c[i] + p1 * (b[i] + d[i]) + p0 * (a[i] + e[i])
            _repeat_border(s)
            _repeat_border(y)
            _repeat_border(t)
            # The rows of a cell add up, each by its weight relative to that of the last row.
            keep = row_weights[part - 1, cell] / row_weights[part, cell] if part > 0 else np.float32(0)
            for i in range(width):
                along = d0 * (s[i + 3] - s[i + 1]) + d1 * (s[i + 4] - s[i])
                down = p2 * y[i + 2] + p1 * (y[i + 1] + y[i + 3]) + p0 * (y[i] + y[i + 4])
                gx[i], gy[i] = along, down
                gt[i] = np.float32(0.5) * (p2 * t[i + 2] + p1 * (t[i + 1] + t[i + 3]) + p0 * (t[i] + t[i + 4]))
                w[i] = np.float32(0.25) / (model * (along * along + down * down) + temporal)
            _add_products(gradients, keep, own, products)
        last = row_weights[1 + height % 2, cell]
        for k in range(10):
            out, line = pooled[k, cell], products[k]
            for i in range(width // 2):
                first, second, third = line[2 * i], line[2 * i + 1], line[min(2 * i + 2, width - 1)]
                if odd:
                    before, own_part, after = column_weights[0, i], column_weights[1, i], column_weights[2, i]
                    out[i] = last * (before * first + own_part * second + after * third)
                else:
                    out[i] = first + second


@compiled_fast
def window_sums(planes, sums):
    """Sums over 5 x 5 windows, the border repeated; planes and sums of shape (n, h, w)."""
    count, height, width = planes.shape
    line = np.empty(width + 4, np.float32)
    for k in range(count):
        for row in range(height):
            a, b, c, d, e = _rows_around(planes[k], row)
            for i in range(width):
                line[i + 2] = a[i] + b[i] + c[i] + d[i] + e[i]
            _repeat_border(line)
            out = sums[k, row]
            for i in range(width):
                out[i] = line[i] + line[i + 1] + line[i + 2] + line[i + 3] + line[i + 4]


@compiled_fast
def centred_sums(windows, least, sums):
    """Products about the means of each window, with at least ``least`` information in every direction.

    Along a weak edge the noise taken out may exceed what was there; motion along it would seem huge and well known. So
    the smaller eigenvalue of J is raised to ``least``.

    Args:
        windows: sums over windows of what ``pooled_products`` gives, shape (10, h, w).
        least: information, (px/interval)^-2.
        sums: result, J_xx, J_xy, J_yy, b_x, b_y, and e, the energy of the temporal gradient, shape (6, h, w).
    """
    height, width = sums.shape[1:]
    for row in range(height):
        wtt, energy = windows[9, row], sums[5, row]
        sx, sy, st, sw = windows[5, row], windows[6, row], windows[7, row], windows[8, row]
        xx, xy, yy, x, y = sums[0, row], sums[1, row], sums[2, row], sums[3, row], sums[4, row]
        wxx, wxy, wyy = windows[0, row], windows[1, row], windows[2, row]
        wx, wy = windows[3, row], windows[4, row]
        for i in range(width):
            mx, my = sx[i] / sw[i], sy[i] / sw[i]
            a, b, c = wxx[i] - mx * sx[i], wxy[i] - mx * sy[i], wyy[i] - my * sy[i]
            a, c = max(a, least), max(c, least)
            spread = np.sqrt((a - c) * (a - c) + np.float32(4) * b * b)
            lacking = max(least - np.float32(0.5) * (a + c - spread), np.float32(0))
            xx[i], xy[i], yy[i] = a + lacking, b, c + lacking
            x[i], y[i] = wx[i] - mx * st[i], wy[i] - my * st[i]
            energy[i] = wtt[i] - st[i] * st[i] / sw[i]


@compiled_fast
def solve_windows(sums, weak, cov, residual):
    """Invert J = sums[:3] with a weak prior into cov and solve residual = -cov b, b = sums[3:5]; see ``solve``."""
    height, width = sums.shape[1:]
    for row in range(height):
        xx, xy, yy, x, y = sums[0, row], sums[1, row], sums[2, row], sums[3, row], sums[4, row]
        cxx, cxy, cyy, u, v = cov[0, row], cov[1, row], cov[2, row], residual[0, row], residual[1, row]
        for i in range(width):
            prior = weak + np.float32(1e-5) * (xx[i] + yy[i])
            determinant = max(xx[i] * yy[i] - xy[i] * xy[i], np.float32(0))
            scale = np.float32(1) / (determinant + prior * (xx[i] + yy[i] + prior))
            a, b, c = (yy[i] + prior) * scale, -xy[i] * scale, (xx[i] + prior) * scale
            cxx[i], cxy[i], cyy[i] = a, b, c
            u[i] = -(a * x[i] + b * y[i])
            v[i] = -(b * x[i] + c * y[i])


@compiled_fast
def _bilinear(coarse, fine):
    """Where a fine line lies on a coarse one: nearest pixel and the one beside it, and their shares; each (2, fine).

    Args:
        coarse: number of pixels of the coarse line.
        fine: number of pixels of the fine line.
    """
    pixels, shares = np.empty((2, fine), np.uint32), np.empty((2, fine), np.float32)  # unsigned is quicker to index by
    for i in range(fine):
        place = (i + 0.5) * coarse / fine - 0.5
        nearest = int(np.floor(place + 0.5))
        beside = nearest + 1 if place > nearest else nearest - 1
        pixels[0, i], pixels[1, i] = nearest, min(max(beside, 0), coarse - 1)
        shares[0, i], shares[1, i] = 1 - abs(place - nearest), abs(place - nearest)
    return pixels, shares


@compiled_fast
def _fine_pixels(pixel, odd):
    """Pixels of a fine line that are decided by one of the coarse line: two, but three by the first if it is odd."""
    return range(2 * pixel + odd * min(pixel, 1), 2 * pixel + 2 + odd)


@compiled_fast
def take_coarse_where_fast(coarse, motion, fastest, scales, sums):
    """Replace the sums of a level by those of the next coarser one, enlarged bilinearly, where that sees fast motion.

    Args:
        coarse: sums of the coarser level, shape (6, h, w).
        motion: its motion, shape (2, h, w).
        fastest: square of the fastest motion that the finer level is trusted with, in px of the coarser.
        scales: of the six sums, from px of the coarser level to px of the finer one.
        sums: of the finer level, shape (6, H, W) with h = H // 2 and w = W // 2; changed in place.
    """
    height, width = motion.shape[1:]
    odd_row, odd_column = sums.shape[1] % 2, sums.shape[2] % 2
    rows, row_shares = _bilinear(height, sums.shape[1])
    columns, column_shares = _bilinear(width, sums.shape[2])
    for row in range(height):
        u, v = motion[0, row], motion[1, row]
        for i in _fine_pixels(row, odd_row):
            here, there, out = coarse[:, rows[0, i]], coarse[:, rows[1, i]], sums[:, i]
            up, down = row_shares[0, i], row_shares[1, i]
            for column in range(width):
                if u[column] * u[column] + v[column] * v[column] <= fastest:
                    continue
                for j in _fine_pixels(column, odd_column):
                    x, other, near, far = columns[0, j], columns[1, j], column_shares[0, j], column_shares[1, j]
                    a, b, c, d = up * near, down * near, up * far, down * far
                    for k in range(6):
                        value = a * here[k, x] + b * there[k, x] + c * here[k, other] + d * there[k, other]
                        out[k, j] = scales[k] * value
