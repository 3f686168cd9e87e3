"""The file ``estimates.csv``: what perception says after each picture, one line each, written as it comes."""

from __future__ import annotations

import csv
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.zero_flow.evidence_map import UNKNOWN
from fixation_gym.replay.looks import Look

ESTIMATES_FILE = "estimates.csv"
Row = dict[str, Any]
"""Cells by column; None where there is nothing to say."""
COLUMNS = (
    *("time_s", "picture", "visible", "centroid_u_px", "centroid_v_px"),
    *("distance_m", "distance_std_m", "x_m", "y_m", "z_m", "nis", "distance_true_m", "mask_overlap"),
    *("map_time_s", "map_known", "map_front", "no_map"),
)
"""``distance_m``: from the true camera, as pictures show it. ``x_m`` to ``z_m``: the target in base. ``map_known`` and
``map_front``: shares of the map's cells. ``no_map``: why there is none."""


def row_of(look: Look, camera: Intrinsics, mask_overlap: float | None) -> Row:
    """What there is to say of one look; pixels are those of the undistorted picture."""
    percept, fixation = look.percept, look.percept.fixation
    found, (depth, std) = fixation.initialised, fixation.depth_seen
    u, v = camera.project(np.array([*fixation.centroid, 1.0])) if fixation.visible else (None, None)
    why = no_map(look)
    cells = percept.zfc.cells
    return {
        "time_s": percept.time,
        "picture": look.name,
        "visible": int(fixation.visible),
        "centroid_u_px": u,
        "centroid_v_px": v,
        "distance_m": depth if found else None,
        "distance_std_m": std if found else None,
        **dict(zip(("x_m", "y_m", "z_m"), fixation.point_base if found else (None,) * 3, strict=True)),
        "nis": fixation.nis if np.isfinite(fixation.nis) else None,
        "distance_true_m": look.truth.distance_m,
        "mask_overlap": mask_overlap,
        "map_time_s": None if why else percept.flow.time,
        "map_known": None if why else float(np.mean(cells != UNKNOWN)),
        "map_front": None if why else float(np.mean(cells > UNKNOWN)),
        "no_map": why,
    }


def no_map(look: Look) -> str:
    """Why a look has no map; empty if it has one."""
    percept = look.percept
    if percept.zfc.fixated_inverse_depth > 0.0:
        return ""
    if not percept.flow.valid:
        return "fewer than three pictures since the start or a gap"
    return "camera at rest" if percept.segmentation.visible else "target not seen"


class RowWriter:
    """Writes rows to a CSV file; each is in the file when ``write`` returns. Use as a context manager."""

    def __init__(self, path: Path) -> None:
        """Begin the file with the names of the columns."""
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.DictWriter(self._file, COLUMNS, lineterminator="\n")
        self._writer.writeheader()
        self._file.flush()

    def write(self, row: Row) -> None:
        """Append a row; numbers keep all their digits."""
        cells = {name: value.item() if isinstance(value, np.generic) else value for name, value in row.items()}
        self._writer.writerow(cells)
        self._file.flush()

    def __enter__(self) -> RowWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.close()
