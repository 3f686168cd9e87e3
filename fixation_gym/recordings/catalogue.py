"""The door for recordings: the reader of a path, by its name or by what is there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

from fixation_gym.errors import UsageError
from fixation_gym.recordings.bag import SUFFIXES as BAG_SUFFIXES
from fixation_gym.recordings.bag import read_bag
from fixation_gym.recordings.layout import FRAMES_FILE, read_layout
from fixation_gym.recordings.npz import read_npz
from fixation_gym.recordings.options import ReaderOptions
from fixation_gym.recordings.public import PUBLIC
from fixation_gym.recordings.recording import RECORDING_METHODS, Recording
from fixation_gym.recordings.seven_scenes import PICTURES, read_seven_scenes
from fixation_gym.recordings.tum import RGB_FILE, read_tum
from fixation_gym.recordings.video import SUFFIXES as VIDEO_SUFFIXES
from fixation_gym.recordings.video import read_video
from fixation_gym.strangers import is_class_name, load_class

_OPTION = "--reader"


@dataclass(frozen=True, slots=True)
class Reader:
    """How recordings of one kind are read."""

    read: Callable[[Path, ReaderOptions], Recording]
    fits: Callable[[Path], bool]
    """Whether a path is of this kind, by the names of its files."""
    what: str
    """What it looks for, in words."""
    takes: tuple[str, ...]
    """Options that it uses."""


def _holds(name: str) -> Callable[[Path], bool]:
    return lambda path: path.is_dir() and next(path.glob(name), None) is not None


def _ends(suffixes: tuple[str, ...]) -> Callable[[Path], bool]:
    return lambda path: path.is_file() and path.suffix.lower() in suffixes


def _is_bag(path: Path) -> bool:
    return _ends(BAG_SUFFIXES)(path) or _holds("metadata.yaml")(path)


READERS: dict[str, Reader] = {
    "layout": Reader(read_layout, _holds(FRAMES_FILE), f"a folder with {FRAMES_FILE}", ("camera",)),
    "tum": Reader(read_tum, _holds(RGB_FILE), f"a folder with {RGB_FILE} (TUM RGB-D)", ("camera",)),
    "7scenes": Reader(read_seven_scenes, _holds(PICTURES), f"a folder with {PICTURES} (7-Scenes)", ("camera",)),
    "npz": Reader(read_npz, _ends((".npz",)), "an .npz of example 03", ("camera",)),
    "video": Reader(read_video, _ends(VIDEO_SUFFIXES), "a video", ("camera", "poses", "quaternion")),
    "bag": Reader(
        read_bag,
        _is_bag,
        f"a ROS bag ({', '.join(BAG_SUFFIXES)}, or a folder with metadata.yaml)",
        ("camera", "image_topic", "depth_topic", "pose_topic", "base_frame"),
    ),
}
"""Readers by name, in the order in which they are tried."""


def open_recording(path: Path, options: ReaderOptions | None = None, reader: str | None = None) -> Recording:
    """Read a recording; its pictures are loaded when they are asked for.

    Args:
        path: of a folder or file.
        options: what the files do not say.
        reader: one of ``READERS``, or ``module:Class``, which is called with the path. None: by what is there.

    Raises:
        UsageError: in one sentence that names file and column, or the option.
    """
    options = options or ReaderOptions()
    if reader is not None and reader not in READERS:
        if not is_class_name(reader):
            raise UsageError(f"unknown reader '{reader}'; choose one of {', '.join(READERS)}, or module:Class")
        recording = load_class(reader, _OPTION, RECORDING_METHODS)(path)
    else:
        if not path.exists():
            raise UsageError(f"there is no recording {path}; public ones can be named: {', '.join(PUBLIC)}")
        name = reader or _fitting(path)
        _check_taken(name, options)
        recording = READERS[name].read(path, options)
    if not len(recording):
        raise UsageError(f"{path} has no pictures")
    return recording


def _fitting(path: Path) -> str:
    for name, reader in READERS.items():
        if reader.fits(path):
            return name
    if path.is_dir() and not any(path.iterdir()):
        raise UsageError(f"{path} is empty")
    known = ", ".join(reader.what for reader in READERS.values())
    raise UsageError(f"{path} is no recording that is known: {known}")


def _check_taken(name: str, options: ReaderOptions) -> None:
    """Check that no option is given in vain."""
    for field in fields(ReaderOptions):
        if getattr(options, field.name) is not None and field.name not in READERS[name].takes:
            takers = ", ".join(other for other, reader in READERS.items() if field.name in reader.takes)
            raise UsageError(
                f"--{field.name.replace('_', '-')} goes with {takers}, but this recording is read as {name}"
            )
