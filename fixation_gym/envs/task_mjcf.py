"""MJCF of the pick task: robosuite's robot at its table, with all that is added to it.

Importing robosuite takes half a second and 50 MB, so its part is kept in the user's cache folder from the first time
on, under a name that changes with all it depends on.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from fixation_gym.envs import scene_mjcf
from fixation_gym.robots import ROBOT

ROBOT_BODIES = ("robot0_", "gripper0_", "fixed_mount0_")
"""Beginnings of the names of the robot's bodies."""
BASE_BODY, HAND_BODY = f"robot0_{ROBOT.simulated.base}", "robot0_right_hand"
_TABLE_SIZE, _TABLE_TOP = (0.8, 0.8, 0.05), (0.0, 0.0, 0.8)
"""Full size of the table's board, and the middle of its upper face in MuJoCo's world, m."""
_FIRST_LINK = f"robot0_{ROBOT.simulated.first_link}"
SceneExtension = Callable[[ET.Element, ET.Element], None]
"""Adds an experiment's own things to the MJCF elements ``asset`` and ``worldbody``."""


def build_xml(extend: SceneExtension | None, looks: bool) -> str:
    """The robot at a table with the object pool, as MJCF.

    Args:
        extend: adds an experiment's own things to the model.
        looks: with the meshes that only people look at; joints and contacts are the same without.
    """
    root = _robot_at_table()
    asset, worldbody, contact = _child(root, "asset"), _child(root, "worldbody"), _child(root, "contact")
    scene_mjcf.add_materials(asset, lambda file: str(_assets() / "textures" / file))
    hand = next(body for body in worldbody.iter("body") if body.get("name") == HAND_BODY)
    scene_mjcf.add_wrist_camera(hand)
    scene_mjcf.add_object_pool(worldbody)
    scene_mjcf.add_background(worldbody, _TABLE_TOP)
    if extend is not None:
        extend(asset, worldbody)
    scene_mjcf.draw_last(worldbody)
    if not looks:
        scene_mjcf.remove_looks(asset, worldbody, ROBOT_BODIES)
    ET.SubElement(contact, "exclude", {"body1": BASE_BODY, "body2": _FIRST_LINK})
    return ET.tostring(root, encoding="unicode")


def _child(root: ET.Element, tag: str) -> ET.Element:
    child = root.find(tag)
    if child is None:
        raise RuntimeError(f"robosuite's model has no <{tag}>; this package knows robosuite {version('robosuite')}'s")
    return child


def _robot_at_table() -> ET.Element:
    """Robosuite's part, out of the cache if it is there; a cache that cannot be read or written is done without."""
    folder = _cache_folder()
    file = None if folder is None else folder / f"robot-at-table-{_key()}.xml"
    if file is not None:
        with contextlib.suppress(OSError, ET.ParseError):
            return ET.parse(file).getroot()
    from fixation_gym.envs.robosuite_backend import robot_at_table

    text = robot_at_table(_TABLE_SIZE, _TABLE_TOP)
    if file is not None:
        _keep(file, text)
    return ET.fromstring(text)


def _keep(file: Path, text: str) -> None:
    """Write a file of the cache, if that can be."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as folder:
            part = Path(folder) / file.name
            part.write_text(text, encoding="utf-8")
            part.replace(file)  # so nobody ever reads half of it


def _key() -> str:
    """Changes with robosuite, where it is installed, and how it is used here."""
    backend = Path(__file__).with_name("robosuite_backend.py").read_bytes()
    parts = (version("robosuite"), str(_assets()), repr((_TABLE_SIZE, _TABLE_TOP, ROBOT.simulated)))
    return hashlib.sha256(backend + "\n".join(parts).encode()).hexdigest()[:16]


def _assets() -> Path:
    """Robosuite's folder of meshes and textures."""
    spec = find_spec("robosuite")
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError("robosuite is missing; install it with: pip install robosuite==1.5.2")
    return Path(spec.submodule_search_locations[0]) / "models" / "assets"


def _cache_folder() -> Path | None:
    """None for a user without a home, as in some containers."""
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(base) if base else Path.home() / ".cache") / "fixation-gym"
    except RuntimeError:
        return None
