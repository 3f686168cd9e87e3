"""Scores of one look at a hard scene: the signs of single pixels and the verdicts on whole obstacles, all rules.

Pixels are asked "nearer than the fixated object?", the table included, as the paper's rule knows no table. A pixel
counts if its true depth differs from Z_f by more than 10 % and what it shows is one thing that stands still: not where
see-through things show something on the other side, not the robot in a mirror, nothing that moves. On a mirror's face
the truth is the virtual image; curved mirrors, whose images have no one place, do not count. Of see-through things and
mirrors in front it is also counted how many of their pixels are called in front, whatever is seen in them. Obstacles
count with their surface; see-through things and mirrors are obstacles, and so is the stand under the fixated object,
about which no vote is held.

All rules are asked at the same pixels: those that answer for themselves (``answering_pixels``). Counted beside: how
many these are, and how the rules do at all pixels with evidence (``supported``), of which map and votes are made.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from fixation_gym.envs.truth_view import Truth
from fixation_gym.experiments.scenarios.rig import Look, ScenarioRig
from fixation_gym.experiments.scenarios.rules import SURFACES, Rule, plane_front
from fixation_gym.experiments.scenarios.scenes import Instance
from fixation_gym.perception.zero_flow.answering_pixels import answering_pixels
from fixation_gym.perception.zero_flow.dot_product_rule import dot_product_front
from fixation_gym.perception.zero_flow.region_vote import VoteSettings, region_votes
from fixation_gym.robots import ROBOT
from fixation_gym.types import FloatArray, MaskArray

PLACES = ("obstacle", "table", "room")
"""What pixels show, by what stands there; a mirror is an obstacle, whatever it shows."""
_CURVED = ("chrome", "brushed")
DEPTH_MARGIN = 0.10
INNER_PX = 3
"""Inner pixels are farther than this from depth edges, px of the flow grid: 6 px of the frames that flow is made of."""
LEAST_REGION_PX = 40
"""Smaller visible parts of obstacles are not asked about, px of the flow grid."""
THIN_PX = 7
"""Things in front that are narrower than this are thin, px of the flow grid: a window and its reach do not fit in."""
_EDGE = 0.12
"""Relative difference of depth within 3x3 pixels that is an edge."""


@dataclass(frozen=True, eq=False)
class PixelTruth:
    """True answers on the grid of the flow, shape (h, w)."""

    side: FloatArray
    """1 nearer, -1 farther, 0 not asked."""
    inner: MaskArray
    image: MaskArray
    """Virtual images of static things that lie clearly behind the fixated object."""
    image_of_obstacle: MaskArray
    """Those of obstacles."""
    thin: MaskArray
    """Parts of obstacles in front that are narrower than ``THIN_PX``."""
    surfaces: dict[str, MaskArray]
    """Pixels of each of ``SURFACES`` that is clearly in front itself, whatever is seen in it."""
    places: dict[str, MaskArray]
    """Pixels of each of ``PLACES``."""
    regions: dict[int, MaskArray]
    """Visible pixels of each obstacle, by its index in the scene."""


def pixel_truth(rig: ScenarioRig, instance: Instance, truth: Truth, target_depth: float) -> PixelTruth:
    """Turn depths and geoms into answers."""
    owners = np.array([*rig.owners, ""])  # index -1: nothing
    owner, image_owner = owners[truth.geom], owners[truth.image_geom]
    on_mirror = np.isfinite(truth.image_depth)
    depth = np.where(on_mirror, truth.image_depth, truth.depth)
    behind_glass = np.where(on_mirror, truth.image_depth, truth.depth_behind_glass)
    side = _side(depth, target_depth)
    side[_side(behind_glass, target_depth) != side] = 0.0
    excluded = (owner == "target") | (on_mirror & ~_is_thing(image_owner))
    if instance.mover is not None:
        moving = rig.sim.obstacles[instance.mover]
        excluded |= (owner == moving) | (image_owner == moving)
    surfaces = _surfaces(rig, truth, on_mirror)
    excluded |= surfaces["curved_mirror"]  # what is seen there has a place of its own for every direction of motion
    side[excluded] = 0.0
    ahead = _side(truth.depth, target_depth) > 0.0
    edges = _edges(depth) | _edges(truth.depth)
    near_edge = cv2.dilate(edges.astype(np.uint8), np.ones((2 * INNER_PX + 1, 2 * INNER_PX + 1), np.uint8))
    image = on_mirror & (side < 0.0)
    on_obstacle, on_table = np.char.startswith(owner, "obstacle"), np.append(rig.is_table, False)[truth.geom]
    return PixelTruth(
        side=side,
        inner=near_edge == 0,
        image=image,
        image_of_obstacle=image & np.char.startswith(image_owner, "obstacle"),
        thin=_thin(on_obstacle & ahead),
        surfaces={name: mask & ahead for name, mask in surfaces.items()},
        places=dict(zip(PLACES, (on_obstacle, on_table, ~on_obstacle & ~on_table), strict=True)),
        regions={index: np.isin(truth.geom, geoms) for index, geoms in enumerate(rig.thing_geoms)},
    )


def _surfaces(rig: ScenarioRig, truth: Truth, on_mirror: MaskArray) -> dict[str, MaskArray]:
    """Pixels whose first surface is one of ``SURFACES``."""
    model = rig.sim.model
    names = [model.mat(index).name if index >= 0 else "" for index in model.geom_matid.tolist()]
    curved = np.isin(np.array([*names, ""])[truth.geom], _CURVED)
    clear = np.append(model.geom_rgba[:, 3] < 1.0, False)[truth.geom] & ~curved & ~on_mirror
    return dict(zip(SURFACES, (clear, curved, on_mirror), strict=True))


def _side(depth: FloatArray, target_depth: float) -> FloatArray:
    relative = depth / target_depth - 1.0
    return np.where(np.abs(relative) > DEPTH_MARGIN, -np.sign(relative), 0.0)


def _is_thing(owner: np.ndarray) -> MaskArray:
    """Obstacles, table, room and target: not the robot."""
    robot = (
        np.char.startswith(owner, "robot") | np.char.startswith(owner, "gripper") | np.char.startswith(owner, "fixed")
    )
    return ~robot & (owner != "")


def _edges(depth: FloatArray) -> MaskArray:
    small = depth.astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(small, kernel) > (1.0 + _EDGE) * cv2.erode(small, kernel))


def _thin(mask: MaskArray) -> MaskArray:
    """Parts of a mask in which no square of ``THIN_PX`` fits."""
    wide = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((THIN_PX, THIN_PX), np.uint8))
    return mask & (wide == 0)


def calls(look: Look) -> dict[Rule, MaskArray]:
    """Pixels that each rule calls nearer, shape (h, w); only those that answer count."""
    percept, zfc = look.percept, look.percept.zfc
    table = ROBOT.workspace.table_height
    with np.errstate(invalid="ignore"):
        exact = zfc.inverse_depth > zfc.fixated_inverse_depth
    return {
        "plane": plane_front(percept.T_base_flow, percept.flow.intrinsics, table, zfc.fixated_inverse_depth),
        "behind": np.zeros_like(exact),
        "paper": dot_product_front(percept.flow, look.twist),
        "exact": exact,
    }


def pixel_counts(look: Look, truth: PixelTruth) -> dict[str, dict[str, int]]:
    """Counts per rule; ratios of their sums are the measures."""
    evidence = look.percept.zfc.supported
    answering = answering_pixels(look.percept.zfc, look.image)
    counted = {rule: _counted(truth, evidence, answering, called) for rule, called in calls(look).items()}
    return {
        rule: {name: int(np.count_nonzero(mask)) for name, mask in masks.items()} for rule, masks in counted.items()
    }


def _counted(truth: PixelTruth, evidence: MaskArray, answering: MaskArray, called: MaskArray) -> dict[str, MaskArray]:
    """What is counted of one rule, each of shape (h, w)."""
    known, front = truth.side != 0.0, truth.side > 0.0
    asked, right = answering & known, called == front
    obstacle, image = truth.places["obstacle"], truth.image
    tested, in_front, thin = evidence & known & obstacle, front & obstacle, front & truth.thin
    part = {
        "asked": asked,
        "inner": asked & truth.inner,
        "surface": asked & obstacle & ~image,
        "inner_obstacle": asked & truth.inner & obstacle,
        "evidence_obstacle": tested,
        "evidence_surface": tested & ~image,
        **{f"on_{place}": asked & mask for place, mask in truth.places.items()},
    }
    return {
        **part,
        "right": asked & right,
        **{f"{name}_right": mask & right for name, mask in part.items() if name != "asked"},
        "front": asked & front,
        "front_called": asked & front & called,
        "called": asked & called,
        "image": asked & image,
        "inner_image": asked & image & truth.inner,
        "inner_image_behind": asked & image & truth.inner & ~called,
        "image_behind": asked & image & ~called,
        "image_of_obstacle": asked & truth.image_of_obstacle,
        "image_of_obstacle_behind": asked & truth.image_of_obstacle & ~called,
        "pixels": known,
        "obstacle_pixels": known & obstacle,
        "front_obstacle": in_front,
        "front_obstacle_called": in_front & answering & called,
        "evidence_front_obstacle_called": in_front & evidence & called,
        "thin": thin,
        "thin_called": thin & answering & called,
        "evidence_thin_called": thin & evidence & called,
        **{f"front_{name}": evidence & mask for name, mask in truth.surfaces.items()},
        **{f"front_{name}_called": evidence & mask & called for name, mask in truth.surfaces.items()},
    }


def votes(look: Look, region: MaskArray, settings: VoteSettings) -> dict[Rule, tuple[float, float]]:
    """Votes for front and behind in a region, by each rule; only the exact one has probability and own motion."""
    zfc = look.percept.zfc
    supported = zfc.supported & region
    result: dict[Rule, tuple[float, float]] = {}
    for rule, called in calls(look).items():
        front = int(np.count_nonzero(supported & called))
        result[rule] = float(front), float(np.count_nonzero(supported) - front)
    result["exact"] = region_votes(zfc, region, settings)
    return result
