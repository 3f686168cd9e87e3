"""What ``replay`` runs, as a value. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tyro

from fixation_gym.errors import UsageError
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.strangers import is_class_name

Pixel = tuple[float, float]
Box = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class ReplayConfig(ReaderOptions):
    """Which recording, and which thing in it."""

    recording: tyro.conf.Positional[Path]
    """Folder or file: the project's own layout, TUM RGB-D, 7-Scenes, a video, an .npz, a ROS bag. Or the name of a
    public recording, which is downloaded once."""
    data: Path | None = None
    """Folder that has the recording, where there is no network; nothing is downloaded then."""
    reader: str | None = None
    """layout, tum, 7scenes, npz, video, bag, or module:Class of your own; by default by what is there."""
    target: str | None = None
    """Which thing is the target: x,y,w,h of a box in the first picture, or x,y of one of its pixels, px; by default
    the masks or the box of the recording."""
    detector: str | None = None
    """Finds the target: colour, mean_shift, box (what the first box shows), or module:Class of your own."""
    estimator: Literal["calibrating", "pose"] = "calibrating"
    """Tells the distance: calibrating learns errors of stamps, hand-eye and focal length as well; pose does not."""
    pose_noise: tuple[float, float] = (3.0, 0.5)
    """Errors of the poses, mm and deg: what calibration of a camera in a hand usually leaves. They stay the same for a
    whole recording, and half as much differs from picture to picture."""
    table_height: float | None = None
    """Height of the table in the frame of the poses, whose z points up, m. Its surface is no obstacle then, and the way
    it moves in the pictures tells the hand-eye error."""
    rerun: Path | None = None
    """Also write pictures, flow, map, target and camera path to this .rrd file, for the viewer Rerun."""

    def check(self) -> None:
        """Check everything that can be checked without the recording.

        Raises:
            UsageError: naming the first bad value and what is allowed, or the extra that is missing.
        """
        from fixation_gym.perception.detection.named import detector_named

        parsed_target(self.target)
        if self.detector is not None:
            detector_named(self.detector)
        if not all(math.isfinite(value) and value > 0.0 for value in self.pose_noise):
            raise UsageError(f"--pose-noise must be two numbers above 0, mm and deg, got {self.pose_noise}")
        if self.table_height is not None and not math.isfinite(self.table_height):
            raise UsageError(f"--table-height must be a number in m, got {self.table_height}")
        if self.rerun is not None and importlib.util.find_spec("rerun") is None:
            raise UsageError("--rerun needs rerun-sdk: pip install 'fixation-gym[viz]'")

    @property
    def resumes(self) -> bool:
        """Whether a killed replay goes on: a file for Rerun cannot, and nobody knows what another detector keeps."""
        return self.rerun is None and not is_class_name(self.detector or "")

    def run_description(self) -> dict[str, Any]:
        """What the estimates depend on."""
        options = {name: getattr(self, name) for name in ReaderOptions.__dataclass_fields__}
        paths = {name: str(value) if isinstance(value, Path) else value for name, value in options.items()}
        given = {name: value for name, value in paths.items() if value is not None}
        own = {"target": self.target, "detector": self.detector, "estimator": self.estimator}
        own |= {"pose_noise": list(self.pose_noise)}
        if self.table_height is not None:
            own |= {"table_height": self.table_height}
        if self.data is not None:
            own |= {"data": str(self.data)}
        return {"recording": str(self.recording), **own, **given}


def parsed_target(text: str | None) -> Box | Pixel | None:
    """The numbers of ``--target``.

    Raises:
        UsageError: if they are not two or four.
    """
    if text is None:
        return None
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (2, 4) or not all(map(math.isfinite, numbers)):
        raise UsageError(f"--target must be x,y,w,h or x,y in px of the first picture, got '{text}'")
    return numbers  # pyright: ignore[reportReturnType]  (two or four of them)
