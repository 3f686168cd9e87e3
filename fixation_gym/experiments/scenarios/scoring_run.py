"""One run of the scenarios experiment: an instance of a scene looked at from the onset of motion, everything scored."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fixation_gym.control.obstacle_term import obstacle_term
from fixation_gym.envs.scene import ObstacleSpec
from fixation_gym.experiments.scenarios.rig import Look, ScenarioRig
from fixation_gym.experiments.scenarios.rules import RULES
from fixation_gym.experiments.scenarios.scenes import CLEAR, Instance
from fixation_gym.experiments.scenarios.scores import (
    DEPTH_MARGIN,
    LEAST_REGION_PX,
    PixelTruth,
    pixel_counts,
    pixel_truth,
    votes,
)
from fixation_gym.geometry.rigid import inverse, transform
from fixation_gym.perception.zero_flow.answering_pixels import answering_pixels
from fixation_gym.perception.zero_flow.obstacle_memory import MemorySettings, ObstacleMemory, believed_points, remember
from fixation_gym.perception.zero_flow.region_vote import Side, VoteSettings, decide
from fixation_gym.perception.zero_flow.zero_flow import UNKNOWN
from fixation_gym.robots import ROBOT
from fixation_policies.servo.gains import ServoGains

SETTLED_S = 0.6
"""From here on pixels are scored; before, every frame is looked at for the first call."""
_EVERY = 4
"""Then every fourth frame is."""
_FRONT_CELL = 200
"""Value of a cell of the map that calls it in front."""
_VOTE = VoteSettings()


@dataclass
class _Record:
    """What was said about one obstacle."""

    verdicts: dict[str, Counter[str]] = field(default_factory=lambda: {rule: Counter() for rule in RULES})
    summed: dict[str, list[float]] = field(default_factory=lambda: {rule: [0.0, 0.0] for rule in RULES})
    first: dict[str, float | None] = field(default_factory=lambda: dict.fromkeys(RULES))
    sides: list[float] = field(default_factory=list)
    pixels: list[int] = field(default_factory=list)


def run_scene(rig: ScenarioRig, scene: str, variant: str, rng: np.random.Generator) -> dict[str, Any]:
    """Look at a random instance of a scene; returns sums over its frames, JSON-able."""
    instance = rig.draw(scene, variant, rng)
    totals: dict[str, Counter[str]] = {rule: Counter() for rule in RULES}
    records = [_Record() for _ in instance.scene.obstacles]
    frames = unknown = asked = moving = 0
    distance_errors: list[float] = []
    for number, look in enumerate(rig.run(instance, rng)):
        settled = look.time >= SETTLED_S
        if settled and number % _EVERY:
            continue
        truth = rig.truth(look)
        answers = pixel_truth(rig, instance, truth, look.target_depth)
        for index, record in enumerate(records):
            _ask(record, look, answers, index, truth.depth, settled)
        if not settled:
            continue
        frames += 1
        fixated = look.percept.zfc.fixated_inverse_depth
        if fixated > 0.0:
            distance_errors.append(abs(1.0 / (fixated * look.target_depth) - 1.0))
        for rule, counts in pixel_counts(look, answers).items():
            totals[rule].update(counts)
        still = answers.side != 0.0
        asked += int(np.count_nonzero(still))
        unknown += int(np.count_nonzero(still & ~answering_pixels(look.percept.zfc, look.image)))
        moving += int(np.count_nonzero(still & look.percept.zfc.moving))
    objects = [
        _described(obstacle, record, instance, index)
        for index, (obstacle, record) in enumerate(zip(instance.scene.obstacles, records, strict=True))
    ]
    return {
        "frames": frames,
        "pixels": asked,
        "unknown": unknown,
        "falsely_moving": moving,
        "distance_error": float(np.median(distance_errors)) if distance_errors else None,
        "rules": {rule: dict(counts) for rule, counts in totals.items()},
        "objects": [item for item in objects if item is not None],
    }


def _ask(record: _Record, look: Look, answers: PixelTruth, index: int, depth: np.ndarray, settled: bool) -> None:
    """Vote on one obstacle in one frame."""
    region = answers.regions[index]
    pixels = int(np.count_nonzero(region))
    if pixels < LEAST_REGION_PX:
        return
    for rule, (front, behind) in votes(look, region, _VOTE).items():
        side = decide(front, behind, _VOTE)
        if side is Side.FRONT and record.first[rule] is None:
            record.first[rule] = look.percept.time  # when the answer is there, a frame after what it is about
        if settled:
            record.verdicts[rule][side.value] += 1
            record.summed[rule][0] += front
            record.summed[rule][1] += behind
    if settled:
        record.sides.append(float(np.median(depth[region])) / look.target_depth)
        record.pixels.append(pixels)


def _described(obstacle: ObstacleSpec, record: _Record, instance: Instance, index: int) -> dict[str, Any] | None:
    """All about one obstacle; None if it was hardly visible, is not clearly on one side, or holds the target up."""
    if not record.sides or index == instance.stand:
        return None
    nearness = float(np.median(record.sides))
    if abs(nearness - 1.0) < DEPTH_MARGIN:
        return None
    finishes = {part.finish for part in obstacle.shape.parts}
    trimmed = not instance.bare and bool({"rim", "label"} & finishes)
    return {
        "kind": obstacle.kind,
        "shape": obstacle.shape.name,
        "alpha": obstacle.rgba[3] if obstacle.kind == "translucent" else 1.0,
        "trimmed": trimmed,
        "moves": index == instance.mover,
        "side": Side.FRONT.value if nearness < 1.0 else Side.BEHIND.value,
        "nearness": nearness,
        "pixels": float(np.mean(record.pixels)),
        "verdicts": {rule: dict(counts) for rule, counts in record.verdicts.items()},
        "final": {rule: decide(sums[0], sums[1], _VOTE).value for rule, sums in record.summed.items()},
        "first_call_s": record.first,
    }


def run_clear(rig: ScenarioRig, variant: str, rng: np.random.Generator) -> dict[str, Any]:
    """Look at a scene without obstacles and count false alarms, JSON-able.

    ``map_alarms`` are onsets of front cells in the map; ``path_alarms`` are onsets of what makes the servo leave its
    path: enough remembered evidence in the volume that the hand would sweep.
    """
    instance = rig.draw(CLEAR, variant, rng)
    gains, settings, memory = ServoGains(), MemorySettings(), ObstacleMemory.empty()
    before = {"map": False, "path": False}
    alarms: Counter[str] = Counter(map=0, path=0)
    front_cells = known_cells = frames = 0
    for look in rig.run(instance, rng):
        percept = look.percept
        frames += 1
        cells = percept.zfc.cells
        front_cells += int(np.count_nonzero(cells > _FRONT_CELL))
        known_cells += int(np.count_nonzero(cells != UNKNOWN))
        # The servo remembers under the same condition.
        if float(np.linalg.norm(percept.fixation.centroid)) < gains.grasp_centred:
            memory = remember(
                memory, percept.zfc, percept.flow.intrinsics, percept.T_base_flow, percept.flow.time, settings
            )
        points, evidence = believed_points(memory, settings)
        to_camera = inverse(percept.T_base_flow)
        in_camera, depth = transform(to_camera, points), float(transform(to_camera, percept.fixation.point_base)[2])
        term = obstacle_term(in_camera, evidence, depth, ROBOT.tool_in_camera[2], gains.obstacle_margin)
        now = {"map": bool((cells > _FRONT_CELL).any()), "path": term.evidence > gains.obstacle_evidence}
        alarms.update(name for name in now if now[name] and not before[name])
        before = now
    return {
        "frames": frames,
        "seconds": instance.duration_s,
        "map_alarms": alarms["map"],
        "path_alarms": alarms["path"],
        "front_cells": front_cells,
        "known_cells": known_cells,
    }
