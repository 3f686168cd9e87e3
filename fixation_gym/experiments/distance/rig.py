"""The arm with a print held in front of its wrist camera: robosuite's Panda under torque control, rendered images.

The rig compiles a model of its own: the one of the pick task plus the print and a far backdrop; everything else is out
of the camera's sight. Nothing stands in the way of the optical axis up to 9 m.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from fixation_gym.envs import scene_mjcf
from fixation_gym.envs.pick_sim import ArmState, PickSim
from fixation_gym.envs.rendering import View
from fixation_gym.envs.scene import SceneSpec, TargetSpec
from fixation_gym.experiments.distance.duck_print import CARD_PER_WIDTH, TEXTURE_SIZE, card_image
from fixation_gym.experiments.distance.sequence import HOME, IMAGE_SIZE
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

CONTROL_FREQUENCY = 25
_BACKDROP_X, _TILES, _TILE = 10.0, 9, "backdrop_"
_THICKNESS = 0.0005


def _add_print(asset: ET.Element, worldbody: ET.Element) -> None:
    """Add the print, a weightless body without contacts, and the backdrop."""
    side = str(TEXTURE_SIZE)
    texture = {"name": "print", "type": "2d", "builtin": "flat", "rgb1": "1 1 1", "width": side, "height": side}
    ET.SubElement(asset, "texture", texture)
    # Half of the brightness is the card's own, so that it is much the same at every distance.
    matt = {"specular": "0", "shininess": "0", "reflectance": "0", "emission": "0.4"}
    ET.SubElement(asset, "material", {"name": "print", "texture": "print", "texuniform": "false", **matt})
    body = ET.SubElement(worldbody, "body", {"name": "print", "pos": "2 0 2", "gravcomp": "1"})
    ET.SubElement(body, "freejoint", {"name": "print_joint"})
    ET.SubElement(body, "inertial", {"pos": "0 0 0", "mass": "0.1", "diaginertia": "1e-3 1e-3 1e-3"})
    untouchable = {"contype": "0", "conaffinity": "0", "group": str(scene_mjcf.VISIBLE_GROUP), "type": "box"}
    ET.SubElement(body, "geom", {"name": "print", "material": "print", "size": "0.1 0.1 0.1", **untouchable})
    # A patchwork of plain tiles: an image all over, but half the time of a textured wall.
    shades = np.random.default_rng(0).uniform(0.25, 0.75, (2 * _TILES, 2 * _TILES))
    for (row, column), shade in np.ndenumerate(shades):
        place = f"{_BACKDROP_X} {row - _TILES + 0.5} {column - _TILES + 0.5 + HOME[2, 3]}"
        tile = {
            "name": f"{_TILE}{row}_{column}",
            "pos": place,
            "size": "0.05 0.5 0.5",
            "rgba": f"{shade:.3f} " * 3 + "1",
        }
        ET.SubElement(worldbody, "geom", tile | untouchable)


class PrintRig:
    """Simulation of arm and print; poses and positions in the robot base frame. Owns a GL context."""

    def __init__(self) -> None:
        """Compile the model and paint the print."""
        self._sim = PickSim(CONTROL_FREQUENCY, _add_print, ROBOT.arm.posture_ahead)
        model = self._sim.model
        self.dt = 1.0 / CONTROL_FREQUENCY
        self._geom = model.geom("print").id
        self._address = model.joint("print_joint").qposadr[0]
        start = model.tex_adr[model.tex("print").id]
        card = card_image()
        model.tex_data[start : start + card.size] = card.ravel()  # before the GL context takes its copy
        self._print_pose = np.eye(4)
        model.vis.quality.numquads = 1  # evenly lit tiles need no subdivision
        # The duck's outline is smoothed by the texture's filter; samples per pixel would only cost time.
        self._view = View(model, scene_mjcf.CAMERA_NAME, *IMAGE_SIZE, full_quality=False, supersampling=1)

    def reset(self, T_base_cam: FloatArray, print_width: float, print_position: FloatArray) -> None:
        """Start at rest.

        Args:
            T_base_cam: pose of the camera, shape (4, 4).
            print_width: of the duck, m.
            print_position: centroid of the duck, shape (3,).
        """
        eye, axis = T_base_cam[:3, 3], T_base_cam[:3, 2]
        target = TargetSpec("box", (1.0, 1.0, 1.0), (0.5, -0.35, -0.077), 0.0)  # on the table, out of sight
        down = (0.2, 0.1, -1.0)
        self._sim.reset(SceneSpec(target, (), tuple(eye), tuple(eye + axis), down, "table_felt"))
        model = self._sim.model
        names = [model.geom(geom).name for geom in range(model.ngeom)]
        shown = [name == "print" or name.startswith(_TILE) for name in names]
        model.geom_group[~np.array(shown)] = scene_mjcf.HIDDEN_GROUP
        half = 0.5 * CARD_PER_WIDTH * print_width
        model.geom_size[self._geom] = [half, half, _THICKNESS]
        self.move_print(print_position)

    def move_print(self, position: FloatArray) -> None:
        """Put the duck's centroid at a position in base, shape (3,), m; the print faces the home camera."""
        sim = self._sim
        base = sim.data.body("print").xpos - sim.body_position("print")
        facing = HOME[:3, :3] @ np.diag([1.0, -1.0, -1.0])  # x right, y up, z towards the camera
        self._print_position = np.array(position, dtype=np.float64)
        x, y, z, w = Rotation.from_matrix(facing).as_quat()
        centre = base + self._print_position - _THICKNESS * facing[:, 2]
        sim.data.qpos[self._address : self._address + 7] = [*centre, w, x, y, z]

    def step(self, twist: FloatArray, image_age: float) -> FloatArray:
        """Run one period with a camera twist, shape (6,); returns the configuration that the image shows."""
        substeps = self._sim.substeps - round(image_age / self._sim.model.opt.timestep)
        return self._sim.step(twist, 0.0)[0][substeps - 1]

    def image(self, exposed: FloatArray | None = None) -> ImageArray:
        """Wrist image of a configuration from ``step``, or of now, without sensor noise, shape (480, 640, 3)."""
        return self._view.render(self._sim.data.qpos if exposed is None else exposed, with_reflections=False)

    @property
    def arm(self) -> ArmState:
        """True state of the arm."""
        return self._sim.arm_state()

    @property
    def print_position(self) -> FloatArray:
        """Centroid of the duck in base, shape (3,), m."""
        return self._print_position.copy()

    def close(self) -> None:
        """Free the GL context; may be called twice."""
        self._view.close()
