"""The arm looks at an instance of a hard scene: what perception says about each frame, and the truth of that frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fixation_gym.control.servo_laws import gaze_rotation, roll_rate
from fixation_gym.envs import sensors
from fixation_gym.envs.config import CONTROL_FREQUENCY, IMAGE_SIZE
from fixation_gym.envs.photoreal.view import PhotorealView
from fixation_gym.envs.pick_sim import PickSim
from fixation_gym.envs.rendering import View
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.envs.scene_mjcf import CAMERA_NAME, HIDDEN_GROUP, obstacle_part_name
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.envs.truth_view import Truth, TruthView
from fixation_gym.experiments.scenarios.scenes import Instance, sample_instance
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import matrix_to_pose, pose_to_matrix
from fixation_gym.perception import Percept, Perception, segment
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray, Observation

INTRINSICS = Intrinsics.from_fovy(*IMAGE_SIZE, ROBOT.camera.fovy)
_GAZE_GAIN, _ROLL_GAIN = 4.0, 1.5
"""1/s."""
_LEAST_AREA = 0.001
"""Share of the image that the target must cover at the start, or the instance is drawn again."""
_ARM_ROOM = 0.02
"""Least distance between arm and obstacles at the start, m."""
_TRIES = 40


@dataclass(frozen=True, eq=False)
class Look:
    """What perception says about a frame, and what was there."""

    time: float
    """Since the onset of motion, of the frame that flow and zero-flow test belong to, s."""
    image: ImageArray
    """The wrist image of that frame."""
    percept: Percept
    twist: FloatArray
    """Measured twist of the camera at that frame, shape (6,)."""
    qpos: FloatArray
    """Configuration that the image shows."""
    target_depth: float
    """True depth of the target's centre, m."""


class ScenarioRig:
    """Simulation, wrist camera, sensors and perception. Owns GL contexts."""

    def __init__(self, noise: SensorNoise, renderer: str = "mujoco") -> None:
        """Compile the model; ``renderer`` makes the pictures that perception sees."""
        self._noise = noise
        self.sim = PickSim(CONTROL_FREQUENCY)
        self._photoreal = PhotorealView(self.sim.model, INTRINSICS) if renderer == "mitsuba" else None
        self._pictures = 0
        self._view = View(self.sim.model, CAMERA_NAME, *IMAGE_SIZE, full_quality=False)
        # Every look is judged by itself, and must not depend on what was learnt in looks before it.
        settings = PerceptionSettings(hand_eye=None)
        self.perception = Perception(INTRINSICS, settings, support_height_m=ROBOT.workspace.table_height)
        self._truth = TruthView(self.sim.model, self.perception.flow_intrinsics)
        self.owners = tuple(self.sim.model.body(body).name for body in self.sim.model.geom_bodyid)
        """Name of the body of every geom."""
        names = [self.sim.model.geom(geom).name for geom in range(self.sim.model.ngeom)]
        self.is_table = np.array(self.owners) == "table"
        """Which geoms are the table or lie flat on it, shape (ngeom,)."""
        self.is_table |= np.char.startswith(np.array(names), "sheet")
        self.thing_geoms: list[list[int]] = []
        """Geoms of every obstacle of the scene, without what holds it up."""

    def draw(self, scene: str, variant: str, rng: np.random.Generator) -> Instance:
        """Draw an instance that the arm can reach and whose target is in view, and reset the simulation to it.

        Raises:
            RuntimeError: if none is found.
        """
        for _ in range(_TRIES):
            try:
                instance = sample_instance(scene, variant, rng)
                self._reset(instance)
            except RuntimeError:  # no room for the scene in this view, or out of the arm's reach
                continue
            if self.sim.clearance() < _ARM_ROOM:
                continue
            shown = self._view.render(self.sim.data.qpos, with_reflections=self._mirror)
            seen = segment(shown, INTRINSICS)  # by MuJoCo always: equal seeds give equal instances
            if seen.visible and seen.area_fraction > _LEAST_AREA and np.linalg.norm(seen.centroid) < 0.06:
                return instance
        raise RuntimeError(f"no instance of scene {scene!r}, variant {variant!r} that the arm can look at")

    def _reset(self, instance: Instance) -> None:
        self.sim.reset(instance.scene)
        self._mirror = any(obstacle.kind == "mirror" for obstacle in instance.scene.obstacles)
        model = self.sim.model
        things = zip(self.sim.obstacles, instance.scene.obstacles, strict=True)
        self.thing_geoms = [[model.geom(name).id for name in _thing_parts(body, thing)] for body, thing in things]
        if instance.bare:
            for body, obstacle in zip(self.sim.obstacles, instance.scene.obstacles, strict=True):
                for name in _trimmings(body, obstacle):
                    model.geom_group[model.geom(name).id] = HIDDEN_GROUP
        if instance.mover is not None:  # neither contacts nor weight, so that it keeps its velocity
            body = model.body(self.sim.obstacles[instance.mover]).id
            model.geom_contype[model.geom_bodyid == body] = model.geom_conaffinity[model.geom_bodyid == body] = 0
            self.sim.data.xfrc_applied[body, :3] = -model.body_mass[body] * model.opt.gravity
        self.sim.step(np.zeros(6), -1.0)
        if self._photoreal is not None:
            self._photoreal.load()
            self._pictures = 0

    def _image(self, qpos: FloatArray) -> ImageArray:
        """What the camera sees of a configuration, shape (H, W, 3)."""
        if self._photoreal is not None:
            self._pictures += 1  # its rays get another seed in every picture
            return self._photoreal.render(qpos, seed=self._pictures)
        return self._view.render(qpos, with_reflections=self._mirror)

    def run(self, instance: Instance, rng: np.random.Generator) -> Iterator[Look]:
        """Move as the instance says, from rest; yields a look per frame once there are three frames."""
        noise, sim = self._noise, self.sim
        errors = sensors.draw_episode_errors(noise, rng)
        self.perception.reset()
        latency = round(noise.image_latency_s / sim.model.opt.timestep)
        exposed, before = sim.data.qpos.copy(), None
        for step in range(round(instance.duration_s * CONTROL_FREQUENCY)):
            time = step / CONTROL_FREQUENCY
            observation = self._observe(time, exposed, errors, rng)
            percept = self.perception.update(observation)
            depth = self._target_depth()
            if before is not None and percept.flow.valid:
                yield Look(before[0].time, before[0].rgb, percept, before[0].camera_twist, before[1], before[2])
            before = observation, exposed, depth
            self._drive(instance)
            twist = _command(instance, time, percept, observation)
            path, _ = sim.step(twist, -1.0)
            exposed = path[sim.substeps - latency - 1]

    def truth(self, look: Look) -> Truth:
        """Truth of a look on the grid of the flow."""
        return self._truth.look(look.qpos)

    def _observe(
        self, time: float, exposed: FloatArray, errors: sensors.EpisodeErrors, rng: np.random.Generator
    ) -> Observation:
        noise, arm = self._noise, self.sim.arm_state()
        image = sensors.measure_image(self._image(exposed), noise, errors.exposure, rng)
        joint_pos, joint_vel, pose, twist = sensors.measure_arm(arm, noise, errors, rng)
        return Observation(time, image, joint_pos, joint_vel, matrix_to_pose(pose), twist, arm.gripper_width)

    def _target_depth(self) -> float:
        pose = self.sim.arm_state().camera_pose
        return float(pose[:3, 2] @ (self.sim.body_position("target") - pose[:3, 3]))

    def _drive(self, instance: Instance) -> None:
        """Keep the moving obstacle at its velocity."""
        if instance.mover is not None:
            body = self.sim.obstacles[instance.mover]
            start = int(self.sim.model.joint(f"{body}_joint").dofadr[0])
            self.sim.data.qvel[start : start + 6] = [*instance.velocity, 0.0, 0.0, 0.0]

    def close(self) -> None:
        """Free the GL contexts; may be called twice."""
        self._view.close()
        self._truth.close()


def _thing_parts(body: str, obstacle: ObstacleSpec) -> list[str]:
    """Names of the parts of an obstacle without what holds it up, if it is not of the same matter."""
    parts = enumerate(obstacle.shape.parts)
    opaque = obstacle.kind == "opaque"
    return [obstacle_part_name(body, index) for index, part in parts if opaque or part.finish != "solid"]


def _trimmings(body: str, obstacle: ObstacleSpec) -> list[str]:
    """Names of the rims and labels of an obstacle."""
    parts = enumerate(obstacle.shape.parts)
    return [obstacle_part_name(body, index) for index, part in parts if part.finish in ("rim", "label")]


def _command(instance: Instance, time: float, percept: Percept, observation: Observation) -> FloatArray:
    """Camera twist: as the instance says, gaze on the target, image level."""
    v = instance.velocity_at(time)
    fixation, T_base_cam = percept.fixation, pose_to_matrix(observation.camera_pose)
    roll = roll_rate(math.atan2(T_base_cam[2, 0], -T_base_cam[2, 1]), _ROLL_GAIN)
    w = gaze_rotation(fixation.centroid, _GAZE_GAIN, 1.0 / fixation.distance_m, v, roll)
    return np.clip(np.array([*v, *w, roll]), -ROBOT.arm.twist_limits, ROBOT.arm.twist_limits)
