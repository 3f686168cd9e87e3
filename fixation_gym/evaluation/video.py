"""MP4 files, captions and contact sheets from RGB frames."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import cv2
import imageio_ffmpeg
import numpy as np

from fixation_gym.evaluation.files import unfinished_file, write_file
from fixation_gym.types import ImageArray

_CAPTION_HEIGHT = 26
_GAP = 4
_WRITE_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)


class VideoWriter:
    """Writes frames to an H.264 MP4 that every player reads. Use as a context manager.

    The file gets its name only once it is complete; an exception leaves none.
    """

    def __init__(self, path: Path, fps: float, crf: int = 23) -> None:
        """Prepare a video; the first frame decides its size. ``crf`` 0 is without loss, more is smaller."""
        self._path = path
        self._temporary = unfinished_file(path)
        self._fps, self._crf = fps, crf
        self._shape: tuple[int, ...] | None = None
        self._encoder: subprocess.Popen[bytes] | None = None

    def add(self, frame: ImageArray) -> None:
        """Append a frame, shape (H, W, 3), RGB.

        Raises:
            ValueError: if its shape is not that of the first frame.
            OSError: if the video cannot be written.
        """
        if self._encoder is None:
            self._shape = frame.shape
            self._encoder = self._start()
        if frame.shape != self._shape:
            raise ValueError(f"all frames must have shape {self._shape}, got {frame.shape}")
        assert self._encoder.stdin is not None
        assert self._encoder.stderr is not None
        try:
            self._encoder.stdin.write(np.ascontiguousarray(_pad_to_even(frame)))
        except BrokenPipeError:
            raise _write_error(self._path, self._encoder.stderr.read()) from None

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            if self._encoder is None:
                return
            if error is not None:
                self._encoder.kill()
            _, complaints = self._encoder.communicate()
            if error is None:
                if self._encoder.returncode != 0:
                    raise _write_error(self._path, complaints)
                self._temporary.replace(self._path)
        finally:
            self._temporary.unlink(missing_ok=True)

    def _start(self) -> subprocess.Popen[bytes]:
        """Run ffmpeg, which encodes what it reads."""
        assert self._shape is not None
        height, width = (size + size % 2 for size in self._shape[:2])
        rate = str(Fraction(self._fps).limit_denominator())
        raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate, "-i", "-")
        encoded = ("-vcodec", "libx264", "-pix_fmt", "yuv420p", "-crf", str(self._crf), "-movflags", "+faststart")
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-v", "error", *raw, "-an", *encoded, "-f", "mp4"]
        # In a session of its own, so that Ctrl-C reaches this process alone.
        return subprocess.Popen(
            [*command, str(self._temporary)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )


def _write_error(path: Path, complaints: bytes) -> OSError:
    """What ffmpeg's complaints mean: it prints the system's reason, but ends with numbers of its own."""
    text = complaints.decode(errors="replace").strip()
    number = next((number for number in _WRITE_ERRORS if os.strerror(number) in text), errno.EIO)
    reason = os.strerror(number) if number != errno.EIO else (text.splitlines() or ["ffmpeg was killed"])[-1]
    return OSError(number, reason, str(path))


def caption(frame: ImageArray, text: str) -> ImageArray:
    """Put a line of text on a dark bar above a frame of shape (H, W, 3)."""
    bar = np.full((_CAPTION_HEIGHT, frame.shape[1], 3), 24, np.uint8)
    cv2.putText(bar, text, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (235, 235, 235), 1, cv2.LINE_AA)
    return np.vstack([bar, frame])


def shrink(frame: ImageArray, width: int) -> ImageArray:
    """Scale a frame of shape (H, W, 3) down to a width in px; a narrower one stays as it is."""
    if frame.shape[1] <= width:
        return frame
    height = round(frame.shape[0] * width / frame.shape[1])
    return cv2.resize(frame, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def contact_sheet(frames: Sequence[ImageArray], columns: int) -> ImageArray:
    """Lay frames out row by row on white; smaller frames sit in the top left corner of their cell.

    Args:
        frames: RGB images of shape (H, W, 3), at least one.
        columns: frames per row.

    Raises:
        ValueError: without frames or columns.
    """
    if not frames or columns < 1:
        raise ValueError(f"a contact sheet needs frames and columns, got {len(frames)} and {columns}")
    columns = min(columns, len(frames))
    rows = -(-len(frames) // columns)
    height = max(frame.shape[0] for frame in frames)
    width = max(frame.shape[1] for frame in frames)
    sheet = np.full((rows * (height + _GAP) + _GAP, columns * (width + _GAP) + _GAP, 3), 255, np.uint8)
    for index, frame in enumerate(frames):
        top = _GAP + index // columns * (height + _GAP)
        left = _GAP + index % columns * (width + _GAP)
        sheet[top : top + frame.shape[0], left : left + frame.shape[1]] = frame
    return sheet


def jpeg(image: ImageArray, quality: int) -> bytes:
    """An RGB image as JPEG; quality is 0 to 100."""
    return _encoded(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])


def write_png(path: Path, image: ImageArray) -> None:
    """Write an RGB image, completely or not at all.

    Raises:
        OSError: if it cannot be written.
    """
    write_file(path, _encoded(".png", image, []))


def _encoded(extension: str, image: ImageArray, options: list[int]) -> bytes:
    ok, data = cv2.imencode(extension, image[..., ::-1], options)  # OpenCV's channel order is BGR
    if not ok:
        raise OSError(f"cannot encode an image of shape {image.shape} as {extension}")
    return data.tobytes()


def evenly_spaced(frames: Sequence[ImageArray], count: int) -> list[ImageArray]:
    """Choose ``count`` frames from first to last; fewer if there are fewer."""
    if len(frames) <= count:
        return list(frames)
    return [frames[index] for index in np.linspace(0, len(frames) - 1, count).round().astype(int)]


def _pad_to_even(frame: ImageArray) -> ImageArray:
    """Repeat the last row or column where a size is odd, which yuv420p cannot store."""
    height, width = frame.shape[:2]
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
