"""``FixationPick-v0``: pick up the red object with a wrist camera and camera-twist actions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from fixation_gym.envs import arguments, config, rewards, sensors, wrist_camera
from fixation_gym.envs.info import info_of
from fixation_gym.envs.photoreal.engine import check_renderer
from fixation_gym.envs.sampling import sample_scene
from fixation_gym.envs.scene import SceneSpec
from fixation_gym.envs.sensor_noise import SensorNoise, resolve_sensor_noise
from fixation_gym.envs.state import Resumable
from fixation_gym.envs.target_box import target_box, target_sight
from fixation_gym.envs.views import Views, overlay
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.rectification import undistorted
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray

if TYPE_CHECKING:
    from fixation_gym.envs.pick_sim import PickSim
    from fixation_gym.envs.rendering import View

_NO_PICTURE, _NO_DEPTH = np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.float32)
_EPISODE = ("scene", "percept", "camera_on", "_np_random", "_np_random_seed", "_noise_rng", "_errors", "_camera")
_EPISODE += ("_steps", "_steps_lifted", "_collided", "_target_box", "_state", "_arm", "_observation")
_EPISODE += ("_last_rgb", "_last_depth", "_depth_rng", "_image_time")
"""What changes in an episode beside the simulation."""


class FixationPickEnv(Resumable, gym.Env[dict[str, Any], np.ndarray]):
    """A Franka Panda (robosuite, MuJoCo) picks up the one red object on a table, seen by its wrist camera.

    **Action** ``Box(-1, 1, (7,), float32)``; values outside are clipped.

    | index | meaning | unit at 1 |
    |---|---|---|
    | 0-2 | camera velocity v_X (right), v_Y (down), v_Z (forward) in the camera frame | 0.15 m/s |
    | 3-5 | camera rotation rate w_X, w_Y, w_Z in the camera frame | 0.8 rad/s |
    | 6 | gripper: below 0 opens, above 0 closes, 0 holds | - |

    **Observation** ``Dict``; vectors are float32. All but the image is of ``time``.

    | key | shape | meaning |
    |---|---|---|
    | ``rgb`` | (H, W, 3) uint8 | wrist image, top-left origin |
    | ``depth`` | (H, W) | with ``depth_camera`` alone: what that says, along the optical axis, m; 0: nothing |
    | ``image_time`` | (1,) | when that was taken, by its stamp: ``time``, if the camera has no delay or clock |
    | ``joint_pos``, ``joint_vel`` | (7,) | arm joints, rad and rad/s |
    | ``gripper_width`` | (1,) | opening between the finger pads, m |
    | ``camera_pose`` | (7,) | position in m and quaternion (w, x, y, z) of the camera in the robot base frame |
    | ``camera_twist`` | (6,) | measured twist [v, w] in the camera frame, m/s and rad/s |
    | ``time`` | (1,) | s since reset |
    | ``target_box`` | (4,) | which thing is the target: x, y, width, height in px of the first image, 0 out of it |

    **Reward** ``"dense"``: potential-based progress, -0.004 per step, +10 on success, -5 for the first collision,
    unless ``reward_weights`` say otherwise; ``"sparse"``: +1 on success, -1 for the first collision. It is the sum of
    ``reward_progress``, ``reward_time``, ``reward_success`` and ``reward_collision`` in ``info``.

    **Start** Red object of random shape, size and pose on the table, obstacles by scenario, camera 0.42-0.49 m away,
    looking within 9 cm of it; of two red objects the target is the one nearer to the first image's centre.
    **End** ``terminated`` on success: target 0.1 m above its resting height for 0.5 s. Time-outs are ``truncated`` by
    the spec's ``max_episode_steps``: 625, which is 25 s at 25 Hz.

    **Info** the same keys in ``reset`` and ``step``: ``is_success``, ``success``, ``collision`` (robot-obstacle contact
    above 1 N, or an obstacle pushed off its place or way by more than 1 cm, so far in the episode), ``clearance_m``
    (between robot and obstacles, at most 0.5), ``distance_true_m`` (depth of the target's centre along the optical
    axis), ``fixation_error_px`` (of that centre from the image centre; NaN behind the camera), and the reward's terms.
    True values never reach the observation.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": config.CONTROL_FREQUENCY}  # noqa: RUF012

    def __init__(
        self,
        scenario: str | Mapping[str, Any] = "clear",
        image_size: tuple[int, int] | None = config.IMAGE_SIZE,
        sensor_noise: str | Mapping[str, Any] | SensorNoise = "nominal",
        control_frequency: int = config.CONTROL_FREQUENCY,
        render_mode: str | None = None,
        render_view: str = "front",
        reward: str = "dense",
        reward_weights: rewards.RewardWeights | Mapping[str, float] | None = None,
        renderer: str = "mujoco",
        depth_camera: bool = False,
    ) -> None:
        """Check the arguments; the simulation itself is built at the first reset.

        Args:
            scenario: name from ``config.SCENARIO_NAMES`` or a mapping of ``config.Scenario`` fields.
            image_size: (height, width) of the wrist image, px; None for observations without ``rgb``.
            sensor_noise: name from ``sensor_noise.SENSOR_NOISE`` or a mapping of ``SensorNoise`` fields.
            control_frequency: steps per second: 10, 20, 25, 50 or 100.
            render_mode: None, "rgb_array" or "human" (MuJoCo's viewer; needs a display).
            render_view: of "rgb_array": "wrist", "front" or "overlay" (both, annotated with the ``percept`` that who
                acts has given to this environment).
            reward: "dense" or "sparse".
            reward_weights: of the dense reward: ``rewards.RewardWeights``, or a mapping with some of them; None for the
                defaults.
            renderer: of ``rgb``: "mujoco", or "mitsuba" with real glass and mirrors (extra ``photoreal``; slow).
            depth_camera: whether observations have ``depth``, as a stereo camera would measure it (``depth_camera``).

        Raises:
            ValueError: for a value that is not allowed; the message says what is.
        """
        check_renderer(renderer)
        self.scenario = config.resolve_scenario(scenario)
        self.noise = resolve_sensor_noise(sensor_noise)
        self._image_size = arguments.checked_image_size(image_size)
        control_frequency = arguments.checked_frequency(control_frequency)
        arguments.check_rendering(render_mode, render_view, self._image_size)
        self.render_mode, self.render_view = render_mode, render_view
        self._depth_camera = arguments.checked_depth_camera(depth_camera, self._image_size)
        self._arguments: dict[str, Any] = {
            "depth_camera": self._depth_camera,
            "image_size": self._image_size,
            "sensor_noise": self.noise,
            "control_frequency": control_frequency,
            "reward": reward,
            "renderer": renderer,
            "reward_weights": rewards.resolve_weights(reward_weights or {}) if reward == "dense" else None,
        }
        self.metadata = self.metadata | {"render_fps": control_frequency}
        self.intrinsics = wrist_camera.intrinsics_of(self._image_size or config.IMAGE_SIZE, self.noise)
        self.hand_eye, self.control_frequency = ROBOT.camera.hand_eye, control_frequency
        self._reward_terms = rewards.choose_terms(reward, reward_weights)
        self.action_space = spaces.Box(-1.0, 1.0, (7,), np.float32)
        self.observation_space = arguments.observation_space(self._image_size, self._depth_camera)
        self._limits = arguments.limits(self.observation_space)
        self._running, self._sim = False, cast("PickSim | None", None)
        self._views = Views(self.intrinsics, renderer)
        self.percept: Percept | None = None
        """What whoever acts perceived in the last observation, if it says so: drawn into the overlay."""
        self.scene: SceneSpec | None = None
        self._last_rgb, self._last_depth, self._image_time = _NO_PICTURE, _NO_DEPTH, 0.0
        self.camera_on = True
        """While False, steps render nothing, and the last image and percept stay: for training, in grasps."""

    # -- Gymnasium interface -------------------------------------------------------------------------------------

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draw a new scene, or take ``options["scene"]``, a ``SceneSpec``; ``checked_scene`` says what is refused."""
        given = arguments.checked_scene(options)
        super().reset(seed=seed)
        # Noise has a generator of its own: scenes depend on the seed alone, not on how long earlier episodes were.
        self._noise_rng = self.np_random.spawn(1)[0]
        self._depth_rng = self._noise_rng.spawn(1)[0]
        self.scene = given or sample_scene(self.scenario, self.np_random)
        self._errors = sensors.draw_episode_errors(self.noise, self._noise_rng)
        self.sim.reset(self.scene)
        self._running = True
        self._steps = self._steps_lifted = 0
        self._collided, self.percept, self.camera_on = False, None, True
        self._image_time = -math.inf
        self._target_box = target_box(self.scene.target, self.sim.arm_state().camera_pose, self.intrinsics)
        self._state = self._task_state()
        self._camera = wrist_camera.switched_on(self.noise, self.data.qpos, self.model.opt.timestep, self._noise_rng)
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, self._info(dict.fromkeys(rewards.TERMS, 0.0))

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Run one control period.

        Raises:
            ValueError: if the action has the wrong shape or holds NaN or infinity.
            gymnasium.error.ResetNeeded: before the first reset, and after ``close``.
        """
        action = arguments.checked_action(action, 7)
        self._require_reset()
        sim = self.sim
        path, hit = sim.step(action[:6] * ROBOT.arm.twist_limits, float(action[6]))
        self._camera = wrist_camera.moved_on(self._camera, self.noise, path, self._noise_rng)
        self._steps += 1
        self._collided = self._collided or hit or sim.obstacle_push() > config.COLLISION_PUSH
        self._steps_lifted = self._steps_lifted + 1 if sim.target_rise() >= config.LIFT_HEIGHT else 0
        before, self._state = self._state, self._task_state()
        terms = self._reward_terms(before, self._state)
        observation = self._observe()
        if self.render_mode == "human":
            self.render()
        return observation, float(sum(terms.values())), self._state.success, False, self._info(terms)

    def render(self) -> ImageArray | None:
        """Picture of the current state (H, W, 3) in mode "rgb_array"; updates the window in mode "human"."""
        if self.render_mode is None:
            gym.logger.warn('render() needs render_mode="rgb_array" or "human" in gym.make')
            return None
        self._require_reset()
        if self.render_mode == "human":
            self._views.show(self.sim)
            return None
        shows_overlay = self.render_view == "overlay"
        shown = self._views.image("front" if shows_overlay else self.render_view, self.sim, self.sim.data.qpos)
        return overlay(undistorted(self._last_rgb, self.intrinsics), self.percept, shown) if shows_overlay else shown

    def close(self) -> None:
        """Free GL contexts, windows and the simulation; may be called twice. A reset builds them again."""
        self._views.close()
        self._sim, self._running = None, False

    def _state_arguments(self) -> dict[str, Any]:
        render = {"render_mode": self.render_mode, "render_view": self.render_view}
        return {**self._arguments, **render, "scenario": self.scenario}

    def _state_settings(self) -> dict[str, Any]:
        return {**self._arguments, "scenario": self.scenario, "robot": ROBOT.simulated.robot}

    def _episode(self) -> dict[str, Any]:
        return {"sim": self.sim.get_state(), **{name: getattr(self, name) for name in _EPISODE}}

    def _continue(self, episode: dict[str, Any]) -> None:
        self.sim.set_state(episode["sim"])
        for name in _EPISODE:
            setattr(self, name, episode[name])

    # -- for checkers, privileged policies and experiments -------------------------------------------------------

    @property
    def sim(self) -> PickSim:
        """The simulation, built at first use: workers build their own."""
        if self._sim is None:
            from fixation_gym.gl import select_backend

            select_backend()
            from fixation_gym.envs.pick_sim import PickSim

            self._sim = PickSim(self.control_frequency)
        return self._sim

    @property
    def picture_qpos(self) -> FloatArray:
        """Configuration of the simulation in the middle of the newest picture's exposure."""
        return wrist_camera.configuration_at(self._camera, self._image_time - self.noise.image_latency_s)

    @property
    def wrist_view(self) -> View:
        """The wrist camera without its lens, for truth about its pictures."""
        return self._views.view("observation", self.sim)

    @property
    def model(self) -> Any:
        """Compiled ``mjModel``."""
        return self.sim.model

    @property
    def data(self) -> Any:
        """The simulation's ``mjData``."""
        return self.sim.data

    @property
    def sensed(self) -> dict[str, Any]:
        """The last observation, whatever a wrapper makes of it."""
        return self._observation

    # -- pieces --------------------------------------------------------------------------------------------------

    def _observe(self) -> dict[str, Any]:
        self._arm = state = self.sim.arm_state()
        observation: dict[str, Any] = {}
        if self._image_size is not None:
            if self.camera_on and self._camera.stamp_s != self._image_time:
                self._take_picture()
            observation["rgb"] = self._last_rgb.copy()
            if self._depth_camera:
                observation["depth"] = self._last_depth.copy()
            observation["target_box"] = self._target_box.astype(np.float32)
        vectors = sensors.arm_reading(state, self.noise, self._errors, self._noise_rng)
        vectors["time"] = [self._steps / self.control_frequency]
        if self._image_size is not None:
            vectors["image_time"] = [self._image_time]
        self._observation = {**observation, **arguments.within(vectors, self._limits)}
        return self._observation

    def _take_picture(self) -> None:
        """Take over the newest picture, and depth in the middle of its exposure."""
        light, exposure = partial(self._views.light, self.sim, self._noise_rng), self._errors.exposure
        self._last_rgb = wrist_camera.picture(self._camera, self.noise, exposure, light, self._noise_rng)
        self._image_time = self._camera.stamp_s
        if self._depth_camera:
            self._last_depth = self._views.depth(self.sim, self.noise, exposure, self._depth_rng, self.picture_qpos)

    def _task_state(self) -> rewards.TaskState:
        distance = math.dist(self.sim.body_position("target"), self.sim.tool_position())
        held = self._steps_lifted >= config.HOLD_SECONDS * self.control_frequency
        return rewards.TaskState(distance, self.sim.target_rise(), held, self._collided)

    def _info(self, terms: dict[str, float]) -> dict[str, Any]:
        sight = target_sight(self._arm.camera_pose, self.sim.body_position("target"), self.intrinsics)
        return info_of(self._state, self.sim.clearance(), sight, terms)
