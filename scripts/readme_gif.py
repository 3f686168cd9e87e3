"""Make the picture at the top of README.md out of the first episode of a demonstration.

fixation-gym demo --scenario mixed --episodes 1 --seed 40 --out out/demo
python scripts/readme_gif.py out/demo/demo.mp4 docs/images/hero.gif
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import cv2
import imageio_ffmpeg
import numpy as np

from fixation_gym.perception.drawing import BEHIND_RGB, FRONT_RGB, MOVING_RGB, TARGET_RGB
from fixation_gym.types import ImageArray

WRIST = slice(0, 480)
"""Columns of the demonstration's frames that show the wrist camera ..."""
FRONT = slice(590, 910)
"""... and the middle of the front view, px."""
STRIDE, FRAMES_PER_SECOND, LEGEND_HEIGHT = 2, 8, 34
WORDS = (
    (TARGET_RGB, "target, with its distance"),
    (FRONT_RGB, "in front of it"),
    (BEHIND_RGB, "behind it"),
    (MOVING_RGB, "moves by itself"),
)
PALETTE = (
    "hqdn3d=3:2:5:4,split[a][b];[a]palettegen=max_colors=128:stats_mode=full[p];"
    "[b][p]paletteuse=dither=none:diff_mode=rectangle"
)
"""ffmpeg's filters: less sensor noise, which no palette can compress, then one palette for all frames."""


def legend(width: int) -> ImageArray:
    """What the colours mean, shape (``LEGEND_HEIGHT``, width, 3), RGB."""
    strip = np.full((LEGEND_HEIGHT, width, 3), 24, np.uint8)
    left = 12
    for colour, text in WORDS:
        cv2.rectangle(strip, (left, 9), (left + 16, 25), colour, -1)
        cv2.putText(strip, text, (left + 26, 23), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (255, 255, 255), 1, cv2.LINE_AA)
        left += 60 + cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.55, 1)[0][0]
    return strip


def frames(video: str, seconds: float) -> Iterator[ImageArray]:
    """Wrist view and the middle of the front view of every second frame, with the legend below."""
    capture = cv2.VideoCapture(video)
    for index in range(round(seconds * capture.get(cv2.CAP_PROP_FPS))):
        read, frame = capture.read()
        if not read:
            return
        if index % STRIDE == 0:
            view = np.hstack([frame[:, WRIST], frame[:, FRONT]]).astype(np.uint8)[..., ::-1]
            yield np.vstack([view, legend(view.shape[1])])


def main(video: str, gif: str, seconds: float = 13.6) -> None:
    """Write the picture."""
    pictures = list(frames(video, seconds))
    height, width = pictures[0].shape[:2]
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(FRAMES_PER_SECOND), "-i", "-"]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-y", *source, "-filter_complex", PALETTE, gif]
    subprocess.run(command, input=np.stack(pictures).tobytes(), check=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
