"""``FixationPickZFC-v0``: where to move and when to grasp, from the zero-flow map; the gaze is held inside."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from fixation_gym.control.gaze import CENTRED
from fixation_gym.control.open_loop import OpenLoopGains
from fixation_gym.envs.arguments import checked_action, require_choice
from fixation_gym.envs.config import CONTROL_FREQUENCY, IMAGE_SIZE
from fixation_gym.envs.perceiving import perception_for
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.rewards import RewardWeights
from fixation_gym.envs.sensor_noise import SensorNoise
from fixation_gym.envs.way_view import way_view
from fixation_gym.envs.zfc_observation import (
    OBSERVATIONS,
    fixation_vector,
    map_levels,
    proprio_vector,
    zfc_observation_space,
)
from fixation_gym.fixator import Fixator, FixatorGains, action_of
from fixation_gym.perception.percept import Percept
from fixation_gym.robots import ROBOT
from fixation_gym.surroundings import Surroundings
from fixation_gym.types import Observation

if TYPE_CHECKING:
    from fixation_gym.envs.privileged_map import ObstacleDepth

_GAINS = FixatorGains(open_loop=OpenLoopGains(hold_seconds=3.0))


class FixationPickZFC(FixationPickEnv):
    """``FixationPick-v0`` for learners: perception, gaze and grasp run inside, the agent chooses the way.

    **Action** ``Box(-1, 1, (4,), float32)``; values outside are clipped.

    | index | meaning | unit at 1 |
    |---|---|---|
    | 0-2 | camera velocity v_X (right), v_Y (down), v_Z (forward) in the camera frame | 0.15 m/s |
    | 3 | above 0 starts the grasp | - |

    The servo laws add the rotation that keeps the fixated object in the image centre, level the hand and turn the
    gripper across the object's narrow axis when near. If the whole is faster than the camera may move (0.15 m/s,
    0.8 rad/s per axis), it is slowed down as a whole. v_X and v_Y are dropped where they would lead out of the arm's
    reach (the servo's limits of azimuth and elevation around the object). Nothing keeps the hand off obstacles or
    table. While the object is out of sight the gaze stays where it is believed to be; before it was first seen the
    camera searches for it and the trigger does nothing.

    The grasp is the paper's open-loop manoeuvre: tool to the target's centre, close, lift; its course changes only if
    the target is pushed, or its body seen better. Actions are ignored until it ends, and every ``step`` is still one
    control period. It fails if the tool takes more than 4 s to get there, if the fingers close on nothing, or 3 s after
    it began to lift without success; then the hand opens, backs off by 12 cm and the agent is in control again.

    **Observation** ``Dict``; the first row depends on ``observation``.

    | key | shape | meaning |
    |---|---|---|
    | ``zfc_map`` ("zfc") | (1, 32, 32) float32 | P(nearer than the fixated object), 0..1; 128/255 = unknown |
    | ``ways`` ("ways") | (2, 32, 32) float32 | remembered ways to the object: barred, never looked at; 0..1 |
    | nothing ("blind") | | |
    | ``rgb`` ("rgb") | (H, W, 3) uint8 | wrist image |
    | ``depth`` ("depth") | (H, W) float32 | what a stereo depth camera says, m; 0: nothing (``depth_camera``) |
    | ``true_map`` ("privileged") | (1, 32, 32) float32 | share of the cell truly nearer than the object, 0..1 |
    | ``fixation`` | (5,) float32 | centroid x, y (normalised image coordinates), visible, distance m, its std m |
    | ``proprio`` | (24,) float32 | see below |

    | proprio | meaning | unit |
    |---|---|---|
    | 0-6 | joint angles | rad |
    | 7-9, 10-12 | camera position and optical axis in the robot base frame | m, - |
    | 13-18 | measured camera twist [v, w] in the camera frame | m/s, rad/s |
    | 19 | opening between the finger pads | m |
    | 20-23 | stage of the manoeuvre: grasp, close, lift, recover; one is 1, or all 0 when the next action counts | - |

    Everything but ``true_map`` comes from the sensors. Maps are floats: as images they would be too small for the
    networks of common libraries. Rewards, end, ``info`` and rendering are those of ``FixationPick-v0``.
    """

    def __init__(
        self,
        scenario: str | Mapping[str, Any] = "clear",
        observation: str = "zfc",
        image_size: tuple[int, int] = IMAGE_SIZE,
        sensor_noise: str | Mapping[str, Any] | SensorNoise = "nominal",
        control_frequency: int = CONTROL_FREQUENCY,
        render_mode: str | None = None,
        render_view: str = "front",
        reward: str = "dense",
        reward_weights: RewardWeights | Mapping[str, float] | None = None,
        renderer: str = "mujoco",
    ) -> None:
        """Check the arguments; the simulation itself is built at the first reset.

        Args:
            scenario: as in ``FixationPickEnv``, like all that follow but for two:
            observation: "zfc", "ways", "blind", "rgb", "depth" or "privileged".
            image_size: (height, width) of the wrist image, px; may not be None, for perception works on it.
            sensor_noise: name from ``sensor_noise.SENSOR_NOISE`` or a mapping of ``SensorNoise`` fields.
            control_frequency: steps per second.
            render_mode: None, "rgb_array" or "human".
            render_view: of "rgb_array".
            reward: "dense" or "sparse".
            reward_weights: of the dense reward.
            renderer: "mujoco" or "mitsuba"; perception sees its picture.

        Raises:
            ValueError: for a value that is not allowed; the message says what is.
        """
        require_choice("observation", observation, OBSERVATIONS)
        if image_size is None:
            raise ValueError("FixationPickZFC-v0 needs an image_size: its perception works on the wrist image")
        super().__init__(
            scenario,
            image_size,
            sensor_noise,
            control_frequency,
            render_mode,
            render_view,
            reward,
            reward_weights,
            renderer,
            depth_camera=observation == "depth",
        )
        self.action_space = spaces.Box(-1.0, 1.0, (4,), np.float32)
        self.observation_space = zfc_observation_space(observation, (self.intrinsics.height, self.intrinsics.width))
        self._shown = observation
        self._arguments["observation"] = observation
        del self._arguments["depth_camera"]  # follows from that
        self._truth: ObstacleDepth | None = None
        self._fixator = Fixator(perception_for(self.scenario, self.intrinsics), _GAINS)
        self._surroundings = Surroundings()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draw a new scene, or take that of the options: see ``FixationPickEnv.reset``."""
        self._truth = None
        sensed, info = super().reset(seed=seed, options=options)
        self._fixator.reset()
        self._surroundings.reset()
        return self._perceived(sensed, info), info

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Run one control period.

        Raises:
            ValueError: if the action has the wrong shape or holds NaN or infinity.
            gymnasium.error.ResetNeeded: before the first reset, and after ``close``.
        """
        action = checked_action(action, 4)
        self._require_reset()
        command = self._fixator.steer(action[:3] * ROBOT.arm.linear_speed, grasp=bool(action[3] > 0.0))
        sensed, reward, terminated, truncated, info = super().step(action_of(command))
        return self._perceived(sensed, info), reward, terminated, truncated, info

    def close(self) -> None:
        """See ``FixationPickEnv.close``."""
        self._truth = None
        super().close()

    def _episode(self) -> dict[str, Any]:
        return {**super()._episode(), "fixator": self._fixator, "surroundings": self._surroundings}

    def _continue(self, episode: dict[str, Any]) -> None:
        super()._continue(episode)
        self._fixator, self._surroundings = episode["fixator"], episode["surroundings"]

    def _true_map(self, distance: float) -> np.ndarray:
        if self._truth is None:
            from fixation_gym.envs.privileged_map import ObstacleDepth

            self._truth = ObstacleDepth(self.wrist_view, self.model)
        return map_levels(self._truth.nearer(self.data, distance))

    def _ways(self, percept: Percept) -> np.ndarray:
        """Remembers what is seen now, and says what is known of the ways."""
        fixation, fixator = percept.fixation, self._fixator
        if fixation.visible and fixator.stage is None and np.linalg.norm(fixation.centroid) < CENTRED:
            self._surroundings.look(percept, fixator.perception.support_height_m)
        return way_view(percept, fixator.T_base_cam, self._surroundings)

    def _perceived(self, sensed: dict[str, Any], info: dict[str, Any]) -> dict[str, Any]:
        """What the learner sees, for the observation and info of ``FixationPick-v0``."""
        reading, fixator = Observation.from_dict(sensed), self._fixator
        self.percept = percept = fixator.look(reading, fresh=self.camera_on)
        observation: dict[str, Any] = {}
        if self._shown == "zfc":
            observation["zfc_map"] = map_levels(percept.zfc.cells)
        elif self._shown == "ways":
            observation["ways"] = self._ways(percept)
        elif self._shown == "rgb":
            observation["rgb"] = reading.rgb
        elif self._shown == "depth":
            observation["depth"] = sensed["depth"]
        elif self._shown == "privileged":
            observation["true_map"] = self._true_map(info["distance_true_m"])
        observation["fixation"] = fixation_vector(percept.fixation)
        observation["proprio"] = proprio_vector(reading, fixator.T_base_cam, fixator.stage)
        return observation
