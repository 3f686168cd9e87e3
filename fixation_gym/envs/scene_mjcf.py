"""MJCF of everything that is added to robosuite's Panda and table: object pool, wrist camera, background, textures."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable

from fixation_gym.envs.object_pool import SLOTS, TARGET_SHAPES
from fixation_gym.envs.shapes import Part, Shape
from fixation_gym.robots import ROBOT

CAMERA_NAME = "wrist"
FRONT_CAMERA_NAME = "front"
VISIBLE_GROUP, STAND_IN_GROUP, ROBOT_GROUP, HIDDEN_GROUP = 1, 3, 4, 5
"""Geom groups: what all cameras see, a coarse robot for mirrors, the robot's looks, unused parts of the pool."""
RED_BODIES = ("target", "distractor")
"""Bodies of the pool that take the target's shapes and colour."""
_OBJECT_FRICTION = "1.0 0.01 0.001"

TEXTURES = {
    "wood_light": "light-wood.png",
    "wood_dark": "dark-wood.png",
    "wood_plain": None,
    "bricks": "white-bricks.png",
    "metal": "steel-scratched.png",
    "table_wood": "gray-woodgrain.png",
    "table_plank": "light-wood.png",
    "table_felt": "gray-felt.png",
    "poster_metal": "brass-ambra.png",
    "poster_earth": "dirt.png",
    "poster_bricks": "white-bricks.png",
    "poster_tiles": "wood-tiles.png",
}
_FLAT = ("table", "poster")
UNSET_RGBA = (0.5, 0.5, 0.5, 1.0)
"""Colour of a geom that takes its material's."""
MIRROR_MATERIAL = "mirror_glass"
FINISH_MATERIALS = {
    "cup": {"specular": "0.8", "shininess": "0.8"},
    "water": {"specular": "0.8", "shininess": "0.8"},
    "chrome": {"rgba": "0.62 0.63 0.65 1", "specular": "1", "shininess": "0.9"},
    "brushed": {"rgba": "0.66 0.66 0.66 1", "specular": "0.7", "shininess": "0.3"},
    "lacquer": {"specular": "1", "shininess": "0.9"},
    "plastic": {"specular": "0.3", "shininess": "0.3"},
}
"""Looks of finishes of the same names, which are right in physically based pictures only; a scene has their colours."""


def add_materials(asset: ET.Element, texture_path: Callable[[str], str]) -> None:
    """Add one material per texture, and the mirror, the model's only reflective one."""
    for name, file in TEXTURES.items():
        attributes = {"name": name, "specular": "0.1", "shininess": "0.1", "reflectance": "0"}
        if file is None:
            attributes["rgba"] = "0.72 0.55 0.36 1"
        else:
            # What is flat shows its texture on its local z faces only; sampling a cube's faces costs a third more.
            flat = name.startswith(_FLAT)
            texture = {"name": f"tex_{name}", "type": "2d" if flat else "cube", "file": texture_path(file)}
            ET.SubElement(asset, "texture", texture)
            attributes["texture"] = f"tex_{name}"
            if name.startswith("table"):
                attributes["rgba"] = "0.7 0.7 0.7 1"  # a white table saturates the image
        ET.SubElement(asset, "material", attributes)
    for name, attributes in FINISH_MATERIALS.items():
        ET.SubElement(asset, "material", {"name": name, "reflectance": "0", **attributes})
    mirror = {"name": MIRROR_MATERIAL, "rgba": "0.25 0.27 0.28 1", "reflectance": "0.85", "specular": "0.6"}
    ET.SubElement(asset, "material", mirror)


def add_wrist_camera(hand: ET.Element) -> None:
    """Mount the camera and its housing on the hand body."""
    mount = ROBOT.camera
    x, y, z = mount.in_hand
    camera = {"name": CAMERA_NAME, "mode": "fixed", "pos": f"{x} {y} {z}", "quat": "0 0.70710678 0.70710678 0"}
    ET.SubElement(hand, "camera", camera | {"fovy": str(math.degrees(mount.fovy))})
    half_x, half_y, half_z = mount.housing  # the image's x axis is the hand's y axis
    housing = {"name": "camera_housing", "type": "box", "size": f"{half_y} {half_x} {half_z}", "mass": str(mount.mass)}
    place = {"pos": f"{x} {y} {z - mount.housing_behind}", "rgba": "0.2 0.2 0.22 1", "group": "1"}
    ET.SubElement(hand, "geom", housing | place)


def add_object_pool(worldbody: ET.Element) -> None:
    """Add target and distractor with the parts of all shapes they can take, and bodies of parts for obstacles."""
    for name in RED_BODIES:
        body = _free_body(worldbody, name)
        for shape in TARGET_SHAPES:
            for index, part in enumerate(shape.parts):
                _add_part(body, red_part_name(name, shape, index), part)
    for slot, parts in enumerate(SLOTS):
        name = f"obstacle{slot}"
        body = _free_body(worldbody, name)
        for index in range(parts):
            _add_part(body, obstacle_part_name(name, index), _UNUSED)


# Off its body's frame: MuJoCo takes what is compiled in that frame to be there for ever, whatever a scene writes later.
_UNUSED = Part("box", (0.01, 0.01, 0.01), (0.01, 0.01, 0.01), yaw=0.1, pitch=0.1)


def red_part_name(body: str, shape: Shape, index: int) -> str:
    """Name of the geom of one part of target or distractor."""
    return f"{body}_{shape.name}_{index}"


def obstacle_part_name(body: str, index: int) -> str:
    """Name of the geom of one part of an obstacle."""
    return f"{body}_{index}"


def _free_body(worldbody: ET.Element, name: str) -> ET.Element:
    # gravcomp is switched off when the body takes part in a scene; parked bodies float without contacts.
    body = ET.SubElement(worldbody, "body", {"name": name, "pos": "0 0 0", "gravcomp": "1"})
    ET.SubElement(body, "freejoint", {"name": f"{name}_joint"})
    ET.SubElement(body, "inertial", {"pos": "0.001 0.001 0.001", "mass": "0.2", "diaginertia": "2e-4 2e-4 2e-4"})
    return body


def _add_part(body: ET.Element, name: str, part: Part) -> None:
    attributes = {
        "name": name,
        "type": part.primitive,
        "size": _numbers(mujoco_size(part)),
        "pos": _numbers(part.pos),
        "quat": _numbers(quaternion(part)),
        "group": str(HIDDEN_GROUP),
        "friction": _OBJECT_FRICTION,
        "condim": "4",
        "rgba": "0.5 0.5 0.5 1",
    }
    ET.SubElement(body, "geom", attributes)


def mujoco_size(part: Part) -> tuple[float, ...]:
    """Sizes as MuJoCo wants them for the primitive."""
    if part.primitive == "cylinder":
        return (part.size[0], part.size[2])
    return part.size[:1] if part.primitive == "sphere" else part.size


def quaternion(part: Part) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of yaw about z after pitch about y."""
    cy, sy = math.cos(part.yaw / 2), math.sin(part.yaw / 2)
    cp, sp = math.cos(part.pitch / 2), math.sin(part.pitch / 2)
    return (cy * cp, -sy * sp, cy * sp, sy * cp)


def add_background(worldbody: ET.Element, table_top: tuple[float, float, float]) -> None:
    """Add what gives the view texture: sheets on the table and boards behind it. Visual only, nothing red."""
    x, y, z = table_top
    sheets = (
        ("poster_metal", -0.25, 0.10, 0.07, 0.09, 0.4),
        ("poster_tiles", 0.27, -0.10, 0.06, 0.08, -0.3),
        ("poster_bricks", 0.25, 0.20, 0.09, 0.07, 0.9),
        ("poster_earth", 0.00, 0.28, 0.09, 0.06, 0.2),
        ("poster_tiles", -0.22, 0.30, 0.06, 0.06, 1.3),
        ("poster_bricks", -0.02, -0.26, 0.08, 0.06, 0.1),
    )
    for index, (material, dx, dy, half_x, half_y, yaw) in enumerate(sheets):
        size = (half_x, half_y, 0.0008)
        _visual_box(worldbody, f"sheet{index}", material, (x + dx, y + dy, z), size, f"0 0 {yaw}")
    boards = (
        ("poster_tiles", -0.25, 0.62, 0.40, 0.1),
        ("poster_earth", 0.45, 0.58, 0.35, -0.5),
        ("poster_bricks", 0.75, 0.10, 0.40, 0.2 - math.pi / 2),
    )
    for index, (material, dx, dy, half_width, yaw) in enumerate(boards):
        # Lies on its back, then is turned upright and about the vertical; MuJoCo's angles are intrinsic x, y, z.
        size = (half_width, 0.6, 0.02)
        _visual_box(worldbody, f"board{index}", material, (x + dx, y + dy, z), size, f"{math.pi / 2} {yaw} 0")
    front = {"name": FRONT_CAMERA_NAME, "mode": "fixed", "fovy": "45"}
    ET.SubElement(worldbody, "camera", front | {"pos": f"{x + 1.05} {y - 0.75} {z + 0.65}", "xyaxes": _FRONT_AXES})


def draw_last(worldbody: ET.Element) -> None:
    """Move floor, walls and boards behind all other geoms of the model.

    MuJoCo draws by order in the model; what is hidden behind things already drawn costs nothing. The floor is a body of
    its own, so that no contact is looked for with the others.
    """
    for body_name, beginnings in (("ground", ("floor",)), ("room", ("wall", "board"))):
        body = ET.SubElement(worldbody, "body", {"name": body_name})
        for geom in worldbody.findall("geom"):
            if geom.get("name", "").startswith(beginnings):
                worldbody.remove(geom)
                body.append(geom)
                if geom.get("type") == "plane":
                    geom.set("size", "3 3 1")  # drawn as quads of this last size; robosuite's give 2304 of them


def remove_looks(asset: ET.Element, worldbody: ET.Element, robot_bodies: tuple[str, ...]) -> None:
    """Take out the robot's geoms without contacts, and every mesh that is then unused.

    MuJoCo clears a byte per node of all meshes' bounding trees at every physics substep: with the Panda's 182,000
    faces a third of the time of a substep.
    """
    for body in worldbody.iter("body"):
        if body.get("name", "").startswith(robot_bodies):
            for geom in body.findall("geom"):
                if geom.get("contype") == geom.get("conaffinity") == "0" and geom.get("mesh"):
                    body.remove(geom)
    used = {geom.get("mesh") for geom in worldbody.iter("geom")}
    for mesh in asset.findall("mesh"):
        if mesh.get("name") not in used:
            asset.remove(mesh)
    _remove_hidden_textures(asset, worldbody)


def _remove_hidden_textures(asset: ET.Element, worldbody: ET.Element) -> None:
    """Take out materials that the wrist camera never sees: the table's, which scenes replace, and that of its legs.

    GL stores a cube's texture six times: these would take 66 MB.
    """
    for geom in worldbody.iter("geom"):
        if geom.get("material") == "table_ceramic":
            geom.set("material", "table_wood")
        elif geom.get("material") == "table_legs_metal":
            del geom.attrib["material"]
    hidden = {"table_ceramic": "tex-ceramic", "table_legs_metal": "tex-steel-brushed", "table_mat": "textable"}
    for name, texture in hidden.items():
        for tag, of_tag in (("material", name), ("texture", texture)):
            element = asset.find(f"{tag}[@name='{of_tag}']")
            if element is not None:
                asset.remove(element)


_FRONT_AXES = "0.58 0.81 0 -0.36 0.26 0.90"


def _visual_box(
    worldbody: ET.Element,
    name: str,
    material: str,
    pos: tuple[float, float, float],
    size: tuple[float, float, float],
    euler: str,
) -> None:
    attributes = {"name": name, "type": "box", "material": material, "pos": _numbers(pos), "size": _numbers(size)}
    attributes |= {"euler": euler, "contype": "0", "conaffinity": "0", "group": str(VISIBLE_GROUP)}
    ET.SubElement(worldbody, "geom", attributes)


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
