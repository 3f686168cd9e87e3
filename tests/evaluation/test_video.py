"""Videos and contact sheets, read back."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import imageio_ffmpeg
import numpy as np
import pytest

from fixation_gym.evaluation.video import VideoWriter, caption, contact_sheet, evenly_spaced, shrink, write_png


def plain(colour: tuple[int, int, int], height: int = 31, width: int = 45) -> np.ndarray:
    return np.full((height, width, 3), colour, np.uint8)


def write_video(path: Path, frames: Iterable[np.ndarray]) -> None:
    with VideoWriter(path, fps=12.5) as video:
        for frame in frames:
            video.add(frame)


def test_a_video_has_the_frames_and_an_even_size(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mp4", [plain((220, 20 * level, 20)) for level in range(10)])
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    meta = next(reader)
    frames = [np.frombuffer(data, np.uint8).reshape(32, 46, 3) for data in reader]
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["size"] == (46, 32)
    assert meta["fps"] == 12.5
    assert len(frames) == 10
    assert frames[5][:31, :45].mean(axis=(0, 1)) == pytest.approx([220, 100, 20], abs=8)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_a_video_that_fails_leaves_no_file(tmp_path: Path) -> None:
    frames = [plain((0, 0, 0)), plain((0, 0, 0), height=33)]
    with pytest.raises(ValueError, match="all frames must have shape"):
        write_video(tmp_path / "a.mp4", frames)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_video_keeps_the_one_before(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_bytes(b"before")

    def interrupted() -> Iterator[np.ndarray]:
        yield plain((0, 0, 0))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(tmp_path / "a.mp4", interrupted())
    assert (tmp_path / "a.mp4").read_bytes() == b"before"


def test_a_video_without_frames_is_no_file(tmp_path: Path) -> None:
    write_video(tmp_path / "a.mp4", [])
    assert list(tmp_path.iterdir()) == []


def test_a_contact_sheet_goes_row_by_row() -> None:
    frames = [plain((value, 0, 0), 10, 20) for value in (50, 100, 150)]
    sheet = contact_sheet(frames, columns=2)
    assert sheet.shape == (2 * 10 + 3 * 4, 2 * 20 + 3 * 4, 3)
    assert [int(sheet[9, 14, 0]), int(sheet[9, 38, 0]), int(sheet[23, 14, 0])] == [50, 100, 150]
    assert sheet[23, 38].tolist() == [255, 255, 255]


def test_a_contact_sheet_needs_frames() -> None:
    with pytest.raises(ValueError, match="needs frames"):
        contact_sheet([], 2)


def test_a_png_keeps_red_red(tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", plain((200, 10, 30)))
    assert cv2.imread(str(tmp_path / "a.png"))[0, 0].tolist() == [30, 10, 200]  # OpenCV reads BGR
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_a_caption_stands_above_the_untouched_frame() -> None:
    frame = plain((1, 2, 3), 40, 200)
    captioned = caption(frame, "clear")
    assert captioned.shape == (66, 200, 3)
    assert np.array_equal(captioned[26:], frame)
    assert captioned[:26].max() > 200


def test_shrinking_keeps_proportions_and_never_enlarges() -> None:
    assert shrink(plain((9, 9, 9), 40, 200), 50).shape == (10, 50, 3)
    assert shrink(plain((9, 9, 9), 40, 200), 400).shape == (40, 200, 3)


def test_evenly_spaced_keeps_first_and_last() -> None:
    frames = [plain((value, 0, 0)) for value in range(101)]
    assert [int(frame[0, 0, 0]) for frame in evenly_spaced(frames, 5)] == [0, 25, 50, 75, 100]
    assert len(evenly_spaced(frames[:3], 5)) == 3


@pytest.mark.parametrize("reads", ["cat >/dev/null", ":"])
@pytest.mark.parametrize(
    ("complaint", "number", "reason"),
    [
        ("[out#0/mp4 @ 0x5] Error closing file: No space left on device", errno.ENOSPC, "No space left on device"),
        ("x264: bad luck", errno.EIO, "x264: bad luck"),
        ("", errno.EIO, "ffmpeg was killed"),
    ],
)
def test_a_video_that_ffmpeg_could_not_write_is_an_error_and_keeps_the_one_before(
    reads: str, complaint: str, number: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ffmpeg = tmp_path / "ffmpeg"
    ffmpeg.write_text(f"#!/bin/sh\n{reads}\necho '{complaint}' >&2\nexit 228\n")
    ffmpeg.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(ffmpeg))
    (tmp_path / "out").mkdir()
    path = tmp_path / "out" / "a.mp4"
    path.write_bytes(b"before")
    with pytest.raises(OSError, match=reason) as caught:
        write_video(path, [plain((220, 20, 20), 300, 400)] * 5)
    assert (caught.value.errno, caught.value.filename) == (number, str(path))
    assert path.read_bytes() == b"before"
    assert list(path.parent.iterdir()) == [path]
