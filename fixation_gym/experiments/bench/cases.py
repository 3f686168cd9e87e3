"""What the benchmark times: our environment, its perception and policy, and the peers that are installed."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import gymnasium as gym
import numpy as np

import fixation_gym  # noqa: F401 - registers the environments
from fixation_gym.envs.config import CONTROL_FREQUENCY
from fixation_gym.envs.zfc_observation import OBSERVATIONS
from fixation_gym.experiments.bench.groups import Case
from fixation_gym.experiments.bench.stages import stages
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.pipeline import Perception
from fixation_gym.robots import ROBOT
from fixation_gym.types import Observation
from fixation_policies.servo.servo_policy import ServoPolicy

Size = tuple[int, int]
"""(height, width), px."""
STEP_SIZES: tuple[Size, ...] = ((84, 84), (128, 128), (240, 320), (480, 640))
PERCEPTION_SIZES: tuple[Size, ...] = ((128, 128), (240, 320), (480, 640))
_FRAMES = 30
ENDLESS = 10**9
"""Steps of an episode that does not end."""


def all_groups() -> list[Callable[[], Iterator[Case]]]:
    """What makes the cases of each process; peers only where they are installed."""
    groups = [environment_cases, learner_cases, perception_cases, lift_cases, lift_image_cases]
    if importlib.util.find_spec("gymnasium_robotics"):
        groups += [fetch_cases, fetch_image_cases]
    if importlib.util.find_spec("panda_gym"):
        groups += [panda_gym_cases, panda_gym_image_cases]
    return groups


def label(size: Size) -> str:
    """Width x height, as people write it."""
    return f"{size[1]}x{size[0]}"


def environment_cases() -> Iterator[Case]:
    """Step and reset of ``FixationPick-v0`` in scenario ``opaque``."""
    sizes: list[Size | None] = [None, *STEP_SIZES]
    for size in sizes:
        env = gym.make("FixationPick-v0", scenario="opaque", image_size=size, max_episode_steps=ENDLESS)
        env.reset(seed=0)
        suffix = "without image" if size is None else label(size)
        yield Case(f"step {suffix}", stepper(env), env.close)
        if size in (None, (128, 128)):
            yield Case(f"reset {suffix}", env.reset)


def learner_cases() -> Iterator[Case]:
    """Step of ``FixationPickZFC-v0`` with every observation, perception and gaze law included."""
    for observation in OBSERVATIONS:
        env = gym.make(
            "FixationPickZFC-v0",
            scenario="opaque",
            image_size=(128, 128),
            observation=observation,
            max_episode_steps=ENDLESS,
        )
        env.reset(seed=0)
        yield Case(f"step 128x128 {observation}", stepper(env), env.close)


def perception_cases() -> Iterator[Case]:
    """Perception and policy on a recorded approach, and OpenCV's dense flows on the same images."""
    for size in PERCEPTION_SIZES:
        recorded = record_approach(size)
        observations = [Observation.from_dict(observation) for observation in recorded]
        yield Case(f"perception {label(size)}", _replay(make_perception(size), observations))
        for name, run in stages(_camera(size), observations):
            yield Case(f"{name} {label(size)}", run)
        yield Case(f"ServoPolicy.act {label(size)}", _act(size, recorded))
        greys = [cv2.cvtColor(observation.rgb, cv2.COLOR_RGB2GRAY) for observation in observations]
        dis = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)
        yield Case(f"DIS ultrafast {label(size)}", _over_pairs(greys, lambda a, b, dis=dis: dis.calc(a, b, None)))  # pyright: ignore[reportCallIssue, reportArgumentType]
        yield Case(f"Farneback {label(size)}", _over_pairs(greys, _farneback))


def record_approach(size: Size) -> list[dict[str, Any]]:
    """Observations of the environment in the servo's first second of one ``opaque`` scene."""
    env = gym.make("FixationPick-v0", scenario="opaque", image_size=size)
    observation, _ = env.reset(seed=0)
    policy = ServoPolicy(make_perception(size))
    policy.reset(0)
    recorded = []
    for _ in range(_FRAMES):
        recorded.append(observation)
        observation, *_ = env.step(policy.act(observation))
    env.close()
    return recorded


def lift_cases() -> Iterator[Case]:
    """Robosuite's ``Lift`` without image."""
    return _lift_cases(None, "")


def lift_image_cases() -> Iterator[Case]:
    """The same with its wrist image."""
    return _lift_cases(128, " 128x128")


def _lift_cases(size: int | None, suffix: str) -> Iterator[Case]:
    """With soft resets; the default ones are timed apart, as they take seconds."""
    from fixation_gym.envs.robosuite_backend import make_lift
    from fixation_gym.gl import select_backend

    select_backend()
    env = make_lift(CONTROL_FREQUENCY, size, hard_reset=False)
    env.reset()
    action = np.zeros(env.action_dim)
    yield Case(f"lift step{suffix}", lambda: env.step(action)[0].get("robot0_eye_in_hand_image"), env.close)
    yield Case(f"lift soft reset{suffix}", env.reset)


def fetch_cases() -> Iterator[Case]:
    """Gymnasium-Robotics' ``FetchPickAndPlace`` without image; importing the package registers it."""
    importlib.import_module("gymnasium_robotics")
    return _gymnasium_cases("fetch", "FetchPickAndPlace-v4")


def fetch_image_cases() -> Iterator[Case]:
    """The same with an image."""
    importlib.import_module("gymnasium_robotics")
    return _gymnasium_image_cases("fetch", "FetchPickAndPlace-v4", {"width": 128, "height": 128})


def panda_gym_cases() -> Iterator[Case]:
    """panda-gym's ``PandaPickAndPlace`` without image."""
    importlib.import_module("panda_gym")
    return _gymnasium_cases("panda-gym", "PandaPickAndPlace-v3")


def panda_gym_image_cases() -> Iterator[Case]:
    """The same with an image."""
    importlib.import_module("panda_gym")
    return _gymnasium_image_cases("panda-gym", "PandaPickAndPlace-v3", {"render_width": 128, "render_height": 128})


def _gymnasium_cases(name: str, env_id: str) -> Iterator[Case]:
    """Step and reset."""
    env = gym.make(env_id, max_episode_steps=ENDLESS)
    env.reset(seed=0)
    yield Case(f"{name} step", stepper(env), env.close)
    yield Case(f"{name} reset", lambda: env.reset() and None)


def _gymnasium_image_cases(name: str, env_id: str, size: dict[str, Any]) -> Iterator[Case]:
    """A step followed by an image."""
    env = gym.make(env_id, max_episode_steps=ENDLESS, render_mode="rgb_array", **size)
    env.reset(seed=0)
    step = stepper(env)

    def run() -> Any:
        step()
        return env.render()

    yield Case(f"{name} step 128x128", run, env.close)


def stepper(env: gym.Env[Any, Any]) -> Callable[[], Any]:
    """Step with a slow cyclic action; returns the wrist image if the observation has one."""
    shape = env.action_space.shape or (1,)
    count = 0

    def run() -> Any:
        nonlocal count
        action = np.zeros(shape, np.float32)
        action[0], action[1] = 0.3 * np.cos(0.1 * count), 0.3 * np.sin(0.1 * count)
        count += 1
        return env.step(action)[0].get("rgb")

    return run


def _replay(perception: Perception, observations: list[Observation]) -> Callable[[], Any]:
    """Feed the recording frame by frame, over and over."""
    index = 0

    def run() -> None:
        nonlocal index
        if index == len(observations):
            perception.reset()
            index = 0
        perception.update(observations[index])
        index += 1

    return run


def _act(size: Size, recorded: list[dict[str, Any]]) -> Callable[[], Any]:
    policy = ServoPolicy(make_perception(size))
    index = 0

    def run() -> None:
        nonlocal index
        if index == len(recorded):
            policy.reset(0)
            index = 0
        policy.act(recorded[index])
        index += 1

    return run


def _over_pairs(greys: list[Any], flow: Callable[[Any, Any], Any]) -> Callable[[], Any]:
    index = 1

    def run() -> None:
        nonlocal index
        flow(greys[index - 1], greys[index])
        index = index % (len(greys) - 1) + 1

    return run


def _farneback(first: Any, second: Any) -> Any:
    return cv2.calcOpticalFlowFarneback(first, second, None, 0.5, 3, 15, 3, 5, 1.2, 0)  # pyright: ignore[reportCallIssue, reportArgumentType]


def _camera(size: Size) -> Intrinsics:
    return Intrinsics.from_fovy(*size, ROBOT.camera.fovy)


def make_perception(size: Size) -> Perception:
    """Perception of the wrist camera with images of that size."""
    return Perception(_camera(size), support_height_m=ROBOT.workspace.table_height)
