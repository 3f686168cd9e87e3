"""Public recordings by name: where they come from, and how one gets here. None of their data comes with the package.

A hash tells that what was downloaded is what others had under this name. So what has none here is not downloaded.
"""

from __future__ import annotations

import os
import tarfile
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fixation_gym.errors import UsageError


@dataclass(frozen=True, slots=True)
class PublicRecording:
    """One public recording; its name is that of its folder, in the archive as well."""

    source: str
    """Address of the archive, a .tgz, or of where the files are if they are not downloaded."""
    licence: str
    what: str
    """What it shows, in words."""
    size_bytes: int | None = None
    """Of the archive; None: nobody says."""
    sha256: str | None = None
    """Of the archive, 64 hexadecimal digits; None: not known."""


_TUM = "https://cvg.cit.tum.de/rgbd/dataset"
PUBLIC: dict[str, PublicRecording] = {
    "rgbd_dataset_freiburg1_xyz": PublicRecording(
        f"{_TUM}/freiburg1/rgbd_dataset_freiburg1_xyz.tgz",
        "CC BY 4.0",
        "TUM RGB-D: a Kinect in a hand, moved along its axes before a desk",
        448_204_271,
        "a0236d97b8c30cd93b653656d2b6c293ff7c982a4130ef2a1a8beecdb124ef98",
    ),
    "rgbd_dataset_freiburg1_desk": PublicRecording(
        f"{_TUM}/freiburg1/rgbd_dataset_freiburg1_desk.tgz",
        "CC BY 4.0",
        "TUM RGB-D: a Kinect in a hand, over four desks",
        344_011_403,
        "e983d6830916e66dc4a46a71368046b149b283de87769690e7aa4e0b9483530c",
    ),
    "rgbd_dataset_freiburg2_xyz": PublicRecording(
        f"{_TUM}/freiburg2/rgbd_dataset_freiburg2_xyz.tgz",
        "CC BY 4.0",
        "TUM RGB-D: a Kinect in a hand, moved slowly along its axes",
    ),
    "dragon": PublicRecording(
        "https://github.com/lagadic/visp-images, rbt/sequence",
        "GPL-2",
        "a RealSense in a hand, a cube before and beside the target; put into the layout by hand",
    ),
    "franka-board": PublicRecording(
        "https://github.com/lagadic/visp, apps/calibration/hand-eye/data-eye-in-hand",
        "GPL-2+",
        "a RealSense on a Franka, 8 stills of a chessboard; put into the layout by hand",
    ),
    "wrist-board": PublicRecording(
        "https://github.com/Jmeyer1292/robot_cal_tools, rct_examples/data/test_set_10x10",
        "Apache-2.0",
        "a wrist camera on an industrial arm, 15 stills of a grid of circles; put into the layout by hand",
    ),
}
"""Public recordings by name. TUM publishes no hashes: these, and the sizes, are what users of the files state alike."""


def located(recording: Path, data: Path | None, public: Mapping[str, PublicRecording] = PUBLIC) -> Path:
    """Where a recording is; a public one is downloaded if it is neither here nor has been before.

    Args:
        recording: a path, or the name of a public recording.
        data: folder that holds it, and in which alone it is looked for; None: anywhere, and nothing is known of it.
        public: what can be named.

    Raises:
        UsageError: if it is not there and cannot be downloaded, naming where it comes from.
    """
    known = public.get(str(recording))
    if data is not None:
        if (data / recording).exists():
            return data / recording
        raise UsageError(f"{data} has no {recording}" + ("" if known is None else f"; it comes from {known.source}"))
    if known is None or recording.exists():
        return recording
    return _fetched(str(recording), known)


def _fetched(name: str, wanted: PublicRecording) -> Path:
    """Folder of a public recording, in the cache of downloads."""
    if wanted.sha256 is None:
        raise UsageError(
            f"no checksum of {name} is known, so it is not downloaded; it comes from {wanted.source} "
            f"({wanted.licence}): put it into a folder and give --data FOLDER"
        )
    try:
        import pooch  # pyright: ignore[reportMissingImports]
    except ModuleNotFoundError as error:
        raise UsageError(
            f"{name} is not here; to download it: pip install 'fixation-gym[fetch]', or get {wanted.source} yourself "
            "and give --data FOLDER"
        ) from error
    cache = pooch.os_cache("fixation-gym")
    place = cache / name
    if place.exists():
        return place
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{name}.", dir=cache) as unfinished:
            archive = pooch.retrieve(wanted.source, wanted.sha256, f"{name}.tgz", unfinished, progressbar=True)
            _unpack(Path(archive), Path(unfinished))
            os.replace(Path(unfinished) / name, place)
    except (OSError, ValueError, tarfile.TarError) as error:  # ValueError: another hash; others of pooch are OSErrors
        reason = str(error).partition("\n")[0]
        raise UsageError(
            f"{name} cannot be downloaded from {wanted.source} ({reason}); get it yourself, and give --data FOLDER"
        ) from error
    return place


def _unpack(archive: Path, folder: Path) -> None:
    with tarfile.open(archive) as files:
        # The default filter of each Python differs; the first versions of 3.10 and 3.11 have none.
        files.extraction_filter = getattr(tarfile, "data_filter", None)
        files.extractall(folder)
