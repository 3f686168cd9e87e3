"""The stages of perception one by one, each on the inputs it has in a recorded approach."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.geometry.rigid import inverse, pose_to_matrix
from fixation_gym.geometry.twist import mean_twist
from fixation_gym.perception.detection.colour import segment
from fixation_gym.perception.detection.tracking import Expectation
from fixation_gym.perception.distance import pose_filter as distance
from fixation_gym.perception.flow.optic_flow import estimate_flow, plane_homography, prepare_grey
from fixation_gym.perception.percept import Percept
from fixation_gym.perception.pipeline import Perception
from fixation_gym.perception.scratch import Scratch
from fixation_gym.perception.settings import PerceptionSettings
from fixation_gym.perception.zero_flow.zero_flow import Gaze, zero_flow_test
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, ImageArray, Observation

_SETTINGS = PerceptionSettings()


@dataclass(frozen=True, eq=False)
class _Moment:
    """Three successive frames of a recording and what perception made of the last."""

    rgbs: tuple[ImageArray, ...]
    times: tuple[float, ...]
    poses: tuple[FloatArray, ...]
    percept: Percept

    @property
    def inverse_distance(self) -> float:
        return 1.0 / self.percept.fixation.distance_m


def stages(camera: Intrinsics, observations: Sequence[Observation]) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Name of each stage and a function that runs it on the next moment of the recording."""
    moments = _moments(camera, observations)
    working = camera.halved(_SETTINGS.flow.max_width)
    scratch = Scratch()
    greys = [[prepare_grey(rgb, working.height, working.width) for rgb in m.rgbs] for m in moments]

    def flow_of(index: int) -> Any:
        moment = moments[index]
        middle = moment.poses[1]
        maps = [plane_homography(inverse(moment.poses[k]) @ middle, moment.inverse_distance, working) for k in (0, 2)]
        last = prepare_grey(moment.rgbs[2], working.height, working.width)
        frames, times = [*greys[index][:2], last], list(moment.times)
        inverse_distance = moment.inverse_distance
        flow = estimate_flow(frames, times, working, (maps[0], maps[1]), inverse_distance, _SETTINGS.flow, scratch)
        return flow.flow, flow.cov  # they are made when first read

    def segment_next(index: int) -> Any:
        moment = moments[index]
        expected = Expectation(moment.percept.fixation.centroid, math.inf)
        return segment(moment.rgbs[2], camera, _SETTINGS.colour, expected)

    def map_of(index: int) -> Any:
        moment = moments[index]
        twist = mean_twist(moment.poses[0], moment.poses[2], moment.times[2] - moment.times[0])
        mask = moment.percept.segmentation.mask
        gaze = Gaze(twist, moment.inverse_distance, 0.05, mask, moment.poses[1])
        return zero_flow_test(moment.percept.flow, gaze, _SETTINGS.zero_flow, None, ROBOT.workspace.table_height)

    def follow(index: int) -> Any:
        moment = moments[index]
        centroid = moment.percept.segmentation.centroid
        state = distance.initialise(centroid, moment.poses[0], _SETTINGS.distance)
        state = distance.update(
            distance.predict(state, 0.04, _SETTINGS.distance), centroid, moment.poses[2], _SETTINGS.distance, 0.02
        )
        return distance.fixation_at(state, moment.poses[2], _SETTINGS.distance, centroid)

    stage_functions = {
        "segmentation": segment_next,
        "flow": flow_of,
        "zero-flow map": map_of,
        "distance filter": follow,
    }
    for name, function in stage_functions.items():
        yield name, _in_turn(function, len(moments))


def _moments(camera: Intrinsics, observations: Sequence[Observation]) -> list[_Moment]:
    """Every three successive observations in which the target is seen."""
    perception = Perception(camera, support_height_m=ROBOT.workspace.table_height)
    percepts = [perception.update(observation) for observation in observations]
    return [
        _Moment(
            tuple(o.rgb for o in observations[k - 2 : k + 1]),
            tuple(o.time for o in observations[k - 2 : k + 1]),
            tuple(pose_to_matrix(o.camera_pose) for o in observations[k - 2 : k + 1]),
            percepts[k],
        )
        for k in range(2, len(observations))
        if percepts[k].segmentation.visible and percepts[k].flow.valid
    ]


def _in_turn(function: Callable[[int], Any], count: int) -> Callable[[], Any]:
    index = -1

    def run() -> None:
        nonlocal index
        index = (index + 1) % count
        function(index)

    return run
