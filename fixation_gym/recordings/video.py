"""A video file with a file of camera poses beside. Times count from the video's first picture."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.recordings.camera_file import read_camera
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.pictures import Forward, check_size
from fixation_gym.recordings.recording import FrameList, RecordedFrame
from fixation_gym.recordings.trajectory import read_trajectory
from fixation_gym.types import ImageArray

SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v")


def read_video(path: Path, options: ReaderOptions) -> FrameList:
    """Read a video with ``options.poses`` and ``options.camera``.

    Raises:
        UsageError: if one of the files is missing or bad.
    """
    if options.camera is None or options.poses is None:
        raise UsageError(f"{path}: a video needs --camera FILE and --poses FILE")
    camera, trajectory = read_camera(options.camera), read_trajectory(options.poses, options.quaternion)
    times = _times(path)
    images = Forward(partial(_images, path))
    frames = [
        RecordedFrame(f"{path.name}, picture {k}", time, partial(_image, images, k, path, camera), trajectory.at(time))
        for k, time in enumerate(times)
    ]
    return FrameList(camera, frames)


def _times(path: Path) -> list[float]:
    """Time of every picture since the first, s, without decoding them."""
    film = _open(path)
    times = []
    while film.grab():
        times.append(film.get(cv2.CAP_PROP_POS_MSEC) / 1000.0)
    film.release()
    if not times:
        raise UsageError(f"{path} has no pictures")
    return [time - times[0] for time in times]


def _images(path: Path) -> Iterator[ImageArray]:
    film = _open(path)
    try:
        while True:
            ok, image = film.read()
            if not ok:
                return
            yield np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)
    finally:
        film.release()


def _image(images: Forward[ImageArray], index: int, path: Path, camera: Intrinsics) -> ImageArray:
    try:
        image = images.at(index)
    except IndexError:
        raise UsageError(f"{path}: picture {index} cannot be decoded") from None
    check_size(image, camera, f"{path}, picture {index},")
    return image


def _open(path: Path) -> cv2.VideoCapture:
    film = cv2.VideoCapture(str(path))
    if not film.isOpened():
        raise UsageError(f"{path} cannot be read as a video")
    return film
