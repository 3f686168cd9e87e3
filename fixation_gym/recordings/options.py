"""What a user may have to say for a recording to be read. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class ReaderOptions:
    """What the files themselves do not say; each reader takes only what it needs."""

    camera: Path | None = None
    """JSON file with width, height, fx, fy, cx, cy and perhaps distortion, as camera.json in docs/recordings.md."""
    poses: Path | None = None
    """Camera poses of a video: CSV with the columns time_s, x_m, y_m, z_m, qw, qx, qy, qz, or such numbers alone."""
    quaternion: Literal["wxyz", "xyzw"] | None = None
    """Order of the quaternions where the files do not say it."""
    image_topic: str | None = None
    """Pictures of a bag, if it has several such topics."""
    depth_topic: str | None = None
    """Depth pictures of a bag, in the view of the pictures."""
    pose_topic: str | None = None
    """Poses of the camera's optical frame in a bag; by default they are looked up in its transforms (tf)."""
    base_frame: str | None = None
    """Frame of the transforms that counts as fixed; by default the root that the camera hangs on."""
