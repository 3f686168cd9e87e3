"""``run_loop``: a policy drives a robot at a steady rate, and the robot rests whatever ends that.

Each period: the newest reading, the policy's answer, one command. The loop ends when the hand holds on to something,
when the target stays out of sight, when readings or pictures stay away, or when its time is over. Then, and after any
exception, the last command is to rest.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from fixation_gym.errors import UsageError
from fixation_gym.perception.percept import Percept
from fixation_gym.robots.robot import Robot
from fixation_gym.types import Command, Observation

REST = Command(np.zeros(6), 0.0)
"""No motion; the fingers stay as they are."""


class Driver(Protocol):
    """Chooses commands, as ``ServoPolicy`` and ``PaperPolicy`` do."""

    percept: Percept | None
    """What it perceived in the last observation."""

    def respond(self, observation: Observation) -> Command:
        """Command for the next period."""
        ...


class Clock(Protocol):
    """Tells the time and waits."""

    def now(self) -> float:
        """Time since any origin, s."""
        ...

    def wait_until(self, time_s: float) -> None:
        """Return when ``now`` has reached a time, at once if it has."""
        ...


class WallClock:
    """The computer's steady clock."""

    def now(self) -> float:
        """Time since any origin, s."""
        return time.monotonic()

    def wait_until(self, time_s: float) -> None:
        """Sleep until then."""
        time.sleep(max(0.0, time_s - self.now()))


@dataclass(frozen=True)
class LoopSettings:
    """Rate and limits of a loop.

    Raises:
        UsageError: for a value that is not a number above 0.
    """

    rate_hz: float = 25.0
    """Periods per second."""
    longest_s: float = 60.0
    """After this time the loop ends."""
    lost_s: float = 8.0
    """It ends when the target was not seen for so long with open fingers. A grasp may take 4 s without a look, and
    backing off as long."""
    hold_s: float = 4.0
    """The hand holds on when it was told to close for so long: closing and lifting take 3 s, and a policy that finds
    the fingers empty opens them."""
    stale_s: float = 0.2
    """It ends when no new reading came for so long."""
    blind_s: float = 0.5
    """It ends when no new picture came for so long, by the pictures' stamps: what was seen last would be taken for what
    is there."""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < math.inf:
                raise UsageError(f"{name} must be a number above 0, got {value!r}")


class End(str, Enum):
    """Why a loop ended."""

    HELD = "held"
    LOST = "lost"
    STALE = "stale"
    TIME = "time"


@dataclass(frozen=True, slots=True)
class LoopReport:
    """How a loop went."""

    end: End
    sentence: str
    """The same for people."""
    periods: int
    """How many there were."""
    late: int
    """How many of them took longer than they should."""


@dataclass(frozen=True, slots=True)
class _Marks:
    """Times on the loop's clock since which something is so, s."""

    read: float
    """Since the last new reading."""
    pictured: float
    """Since the last new picture."""
    seen: float
    """Since the target was last seen, or closed fingers hid it."""
    opened: float
    """Since the fingers were last open, as they are until they are told to close."""
    picture_time: float = -math.inf
    """Stamp of the newest picture."""
    closed: bool = False
    """Whether the fingers were told to close, and not to open since."""


def run_loop(
    robot: Robot, driver: Driver, settings: LoopSettings | None = None, clock: Clock | None = None
) -> LoopReport:
    """Let a policy drive a robot until it holds something or has to stop; the robot rests then.

    Args:
        robot: ready to move.
        driver: the policy; it was reset.
        settings: rate and limits; None for the defaults.
        clock: what keeps the rate; None: the computer's.

    Raises:
        UsageError: if readings go back in time, or the policy asks for a motion that is none.
        ValueError: from the policy, for an observation that perception cannot take.
    """
    settings, clock = settings or LoopSettings(), clock or WallClock()
    with _resting_after(robot):
        return _run(robot, driver, settings, clock)


@contextmanager
def _resting_after(robot: Robot) -> Iterator[None]:
    """Whatever happens inside, the last command is to rest."""
    try:
        yield
    finally:
        robot.command(REST)


def _run(robot: Robot, driver: Driver, settings: LoopSettings, clock: Clock) -> LoopReport:
    period = 1.0 / settings.rate_hz
    start = due = clock.now()
    marks, read_time = _Marks(start, start, start, start), -math.inf
    periods = late = 0
    while True:
        observation = robot.observe()
        if observation.time < read_time:
            raise UsageError(f"readings must go forward in time: {observation.time} s came after {read_time} s")
        if observation.time > read_time:
            read_time = observation.time
            command = _checked(driver.respond(observation))
            robot.command(command)
            marks = _marked(marks, observation, driver.percept, command, clock.now())
        periods += 1
        due += period
        now = clock.now()
        end = _ended(marks, now, start, settings)
        if end is not None:
            return LoopReport(*end, periods, late)
        if now > due:  # the next period begins where it would have, so that lateness does not add up
            late += 1
            due += period * math.floor((now - due) / period)
        clock.wait_until(due)


def _checked(command: Command) -> Command:
    twist = np.asarray(command.camera_twist)
    if twist.shape != (6,) or not np.isfinite(twist).all() or not math.isfinite(command.gripper):
        raise UsageError(
            f"the policy must ask for a twist of 6 finite numbers and a gripper command, got {twist.tolist()} and "
            f"{command.gripper}"
        )
    return command


def _marked(marks: _Marks, observation: Observation, percept: Percept | None, command: Command, now: float) -> _Marks:
    """Marks after a reading was answered."""
    closed = command.gripper > 0.0 or (marks.closed and command.gripper == 0.0)
    seen = closed or (percept is not None and percept.fixation.visible)
    taken = observation.time if observation.image_time is None else observation.image_time
    return _Marks(
        read=now,
        pictured=now if taken > marks.picture_time else marks.pictured,
        seen=now if seen else marks.seen,
        opened=marks.opened if closed else now,
        picture_time=max(taken, marks.picture_time),
        closed=closed,
    )


def _ended(marks: _Marks, now: float, start: float, settings: LoopSettings) -> tuple[End, str] | None:
    """Why the loop ends, if it does."""
    held, lost, stale, blind = (now - since for since in (marks.opened, marks.seen, marks.read, marks.pictured))
    if held >= settings.hold_s:
        return End.HELD, f"the hand holds on to something, {now - start:.1f} s after the start"
    if lost >= settings.lost_s:
        return End.LOST, f"the target was not seen for {lost:.1f} s, so the robot rests; bring it into view"
    if stale >= settings.stale_s:
        return End.STALE, f"the robot gave no new reading for {stale:.2f} s, so it is told to rest"
    if blind >= settings.blind_s:
        return End.STALE, f"the camera gave no new picture for {blind:.2f} s, so the robot rests"
    if now - start >= settings.longest_s:
        return End.TIME, f"{settings.longest_s:g} s are over"
    return None
