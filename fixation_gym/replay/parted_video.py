"""A video in parts, of which a killed process leaves those that were complete; in the end they are joined."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from types import TracebackType

import imageio_ffmpeg

from fixation_gym.evaluation.files import unfinished_file
from fixation_gym.evaluation.video import VideoWriter
from fixation_gym.types import ImageArray


def parts_of(path: Path) -> list[Path]:
    """Parts of a video that was not joined, in order."""
    return sorted(path.parent.glob(f"{path.stem}.part-*{path.suffix}"))


class PartedVideo:
    """Writes frames to an MP4, as ``VideoWriter`` does. Use as a context manager."""

    def __init__(self, path: Path, fps: float, parts: int = 0) -> None:
        """Go on after some complete parts; later ones that are there are written again."""
        self._path, self._fps, self._parts = path, fps, parts
        for later in parts_of(path)[parts:]:
            later.unlink()
        self._begin()

    def add(self, frame: ImageArray) -> None:
        """Append a frame, shape (H, W, 3), RGB; see ``VideoWriter.add``."""
        self._writer.add(frame)

    def end_part(self) -> None:
        """Complete the part; at least one frame was added to it."""
        self._writer.__exit__(None, None, None)
        self._parts += 1
        self._begin()

    def __enter__(self) -> PartedVideo:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, traceback)
        if error is None:
            _join(parts_of(self._path), self._path)

    def _begin(self) -> None:
        name = f"{self._path.stem}.part-{self._parts:06d}{self._path.suffix}"
        self._writer = VideoWriter(self._path.with_name(name), self._fps)


def _join(parts: list[Path], path: Path) -> None:
    """Make one video of parts of the same size and rate, which are removed."""
    if len(parts) > 1:
        temporary, listed = unfinished_file(path), unfinished_file(path.with_suffix(".txt"))
        try:
            listed.write_text("".join(f"file '{part.name}'\n" for part in parts), encoding="utf-8")
            joining = ("-f", "concat", "-safe", "0", "-i", str(listed), "-c", "copy", "-movflags", "+faststart")
            command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", *joining, "-f", "mp4", str(temporary)]
            done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
            if done.returncode != 0:
                reason = done.stderr.decode(errors="replace").strip().splitlines() or ["ffmpeg was killed"]
                raise OSError(f"cannot write {path}: {reason[-1]}")
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
            listed.unlink(missing_ok=True)
        for part in parts:
            part.unlink()
    elif parts:
        os.replace(parts[0], path)
