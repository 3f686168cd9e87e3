"""Boxes that meet, and how many steps apart from each other they are."""

import numpy as np
import pytest

from fixation_gym.control.box_tests import (
    Aligned,
    aligned,
    any_meets,
    boxes_meet,
    packed,
    packed_hand,
    pairs_that_meet,
    steps_off,
    steps_past,
)
from fixation_gym.control.corridor import level_axes
from fixation_gym.envs.room import Room, holds, steps_to_room
from fixation_gym.geometry.boxes import BoxSet, joined, rotations

STEPS = 30


def boxes_at(rng: np.random.Generator, count: int, spread: float) -> BoxSet:
    yaws, pitches = rng.uniform(-3.0, 3.0, count), rng.choice([0.0, 0.0, 0.4], count)
    return BoxSet(
        rng.uniform(-spread, spread, (count, 3)), rotations(yaws, pitches), rng.uniform(0.005, 0.08, (count, 3))
    )


def hand_at(rng: np.random.Generator) -> Aligned:
    return aligned(rng.uniform(-0.1, 0.1, (3, 3)), rng.uniform(0.01, 0.06, (3, 3)))


def axes_at(rng: np.random.Generator, count: int) -> np.ndarray:
    directions = rng.normal(size=(count, 3))
    return level_axes(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def step_at(rng: np.random.Generator) -> tuple[float, float, float]:
    angle = rng.uniform(-3.0, 3.0)
    return 0.02 * float(np.cos(angle)), 0.02 * float(np.sin(angle)), 0.0


def cube(x: float) -> BoxSet:
    return BoxSet(np.array([[x, 0.0, 0.0]]), np.eye(3)[None], np.full((1, 3), 0.05))


@pytest.mark.parametrize(("x", "steps"), [(0.0, 4), (0.02, 3), (0.095, 1), (0.105, 0), (-0.095, 7), (-0.105, 0)])
def test_two_cubes_are_apart_after_as_many_steps_as_one_counts(x, steps):
    """Ten centimetres wide both, they meet as long as their centres are nearer than that; a step is three."""
    assert steps_off(packed(cube(x)), packed(cube(0.0)), 0.0, (0.03, 0.0, 0.0)) == steps
    eye, hand = np.eye(3)[None], packed_hand(aligned(np.zeros((1, 3)), np.full((1, 3), 0.05)))
    assert steps_past(np.zeros((1, 3)), eye, 0, packed(cube(x)), hand, (0.03, 0.0, 0.0))[0] == steps


def test_what_does_not_move_stays_where_it_meets():
    assert steps_off(packed(cube(0.0)), packed(cube(0.0)), 0.0, (0.0, 0.0, 0.0)) > 1000


def test_no_step_is_passed_over_at_which_boxes_are_apart():
    for seed in range(300):
        rng = np.random.default_rng(seed)
        boxes, others, step = boxes_at(rng, 2, 0.1), boxes_at(rng, 2, 0.1), step_at(rng)
        more = steps_off(packed(boxes), packed(others), 0.012, step)
        meet = [boxes_meet(boxes.moved(count * np.array(step)), others, 0.012) for count in range(min(more, STEPS) + 1)]
        assert all(meet[:more])
        assert more > 0 or not meet[0]


def test_no_step_is_passed_over_at_which_boxes_are_off_all_hands():
    for seed in range(300):
        rng = np.random.default_rng(seed)
        boxes, hand, step = boxes_at(rng, 2, 0.2), hand_at(rng), step_at(rng)
        targets, axes = rng.uniform(-0.05, 0.05, (2, 3)), axes_at(rng, 3)
        more, met = steps_past(targets, axes, int(rng.integers(6)), packed(boxes), packed_hand(hand), step)
        hits = [any_meets(target, axes, boxes, hand).any() for target in targets]
        assert (more > 0) == any(hits)
        for count in range(min(more, STEPS)):
            moved = boxes.moved(count * np.array(step))
            assert any_meets(targets[met // 3], axes[[met % 3]], moved, hand)[0]


def test_room_is_found_at_the_first_of_all_steps_that_has_it():
    for seed in range(200):
        rng = np.random.default_rng(seed)
        boxes = boxes_at(rng, 3, 0.06).moved(np.array([*rng.uniform(-0.05, 0.05, 2), 0.15]))
        step, table = step_at(rng), rng.uniform(0.25, 0.6) * np.array([[-1.0, 1.0], [-1.0, 1.0]])
        reds = packed(boxes_at(rng, 1, 0.02))
        room = Room(0.0, table, reds, np.zeros((1, 3)), axes_at(rng, 3), packed_hand(hand_at(rng)))
        having = [count for count in range(STEPS + 1) if holds(room, boxes.moved(count * np.array(step)))]
        assert steps_to_room(packed(boxes), step, STEPS, room) == (having[0] if having else -1)


def test_pairs_of_sets_meet_as_each_two_of_them_do():
    for seed in range(50):
        rng = np.random.default_rng(seed)
        sets = [boxes_at(rng, int(count), 0.3) for count in rng.integers(1, 5, 6)]
        ends = np.cumsum([0, *(len(boxes.centres) for boxes in sets)])
        meet = pairs_that_meet(packed(joined(sets)), ends, 0.006)
        for i, first in enumerate(sets):
            for j, second in enumerate(sets[:i]):
                assert meet[i, j] == meet[j, i] == boxes_meet(first, second, 0.006)
