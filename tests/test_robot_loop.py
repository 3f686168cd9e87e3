"""The robot loop keeps its rate and always leaves a robot that rests, by a fake clock and a fake robot."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fixation_gym.errors import UsageError
from fixation_gym.robot_loop import End, LoopSettings, WallClock, run_loop
from fixation_gym.types import Command, Observation

POSE = np.array([0.4, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0])
IMAGE = np.zeros((8, 8, 3), np.uint8)


class Bench:
    """Clock and robot in one: time passes only in waits and where a test says so."""

    def __init__(self, readings=lambda time: time, pictures=lambda time: None):
        self.time, self.readings, self.pictures = 100.0, readings, pictures
        self.commands, self.command_times = [], []

    def now(self):
        return self.time

    def wait_until(self, time_s):
        self.time = max(self.time, time_s)

    def observe(self):
        observation = Observation.of_camera(self.readings(self.time), IMAGE, POSE)
        return replace(observation, image_time=self.pictures(self.time))

    def command(self, command):
        self.commands.append(command)
        self.command_times.append(self.time)


class Driver:
    """Turns the camera; sees the target and closes the fingers when a test says so, and takes time to answer."""

    def __init__(self, bench, seen=lambda k: True, closes=lambda k: False, takes=lambda k: 0.01):
        self.bench, self.seen, self.closes, self.takes = bench, seen, closes, takes
        self.percept, self.k = None, -1

    def respond(self, observation):
        self.k += 1
        self.bench.time += self.takes(self.k)
        self.percept = SimpleNamespace(fixation=SimpleNamespace(visible=self.seen(self.k)))
        return Command(np.full(6, 0.1), 1.0 if self.closes(self.k) else -1.0)


def rests(bench):
    return not bench.commands[-1].camera_twist.any() and bench.commands[-1].gripper == 0.0


def run(bench, driver, **settings):
    return run_loop(bench, driver, LoopSettings(**settings), bench)


def test_commands_come_at_the_rate_until_the_time_is_over():
    bench = Bench()
    report = run(bench, Driver(bench), rate_hz=20.0, longest_s=2.0)
    np.testing.assert_allclose(np.diff(bench.command_times[:-1]), 0.05, atol=1e-9)
    assert (report.end, report.late) == (End.TIME, 0)
    assert report.periods == pytest.approx(2.0 * 20.0, abs=1)
    assert rests(bench)


def test_a_late_answer_is_counted_and_neither_shifts_the_others_nor_is_made_up_for():
    bench = Bench()
    report = run(bench, Driver(bench, takes=lambda k: 0.13 if k == 5 else 0.01), rate_hz=20.0, longest_s=2.0)
    assert report.late == 1
    times = (np.array(bench.command_times[:-1]) - 100.01) / 0.05
    on_grid = np.isclose(times, np.round(times), atol=1e-6)
    assert np.flatnonzero(~on_grid).tolist() == [5, 6]  # the late one, and the next at once
    assert len(times) == 41 - 1  # one was left out


def test_a_lost_target_ends_the_loop_with_a_sentence_and_a_robot_at_rest():
    bench = Bench()
    report = run(bench, Driver(bench, seen=lambda k: k < 10), rate_hz=20.0, lost_s=1.0)
    assert report.end is End.LOST
    assert "the target was not seen for 1.0 s" in report.sentence
    assert bench.time == pytest.approx(100.0 + 9 * 0.05 + 1.0, abs=0.06)
    assert rests(bench)


def test_a_target_that_was_never_seen_is_lost_and_one_that_comes_back_is_not():
    bench = Bench()
    assert run(bench, Driver(bench, seen=lambda k: False), lost_s=0.5).end is End.LOST
    assert bench.time == pytest.approx(100.5, abs=0.05)
    bench = Bench()
    assert run(bench, Driver(bench, seen=lambda k: k % 10 == 0), lost_s=0.5, longest_s=3.0).end is End.TIME


def test_closed_fingers_hide_the_target_and_end_the_loop_when_they_hold_on():
    bench = Bench()
    driver = Driver(bench, seen=lambda k: k < 5, closes=lambda k: k >= 20)
    report = run(bench, driver, rate_hz=20.0, lost_s=1.0, hold_s=2.0)
    assert report.end is End.HELD
    assert bench.time == pytest.approx(100.0 + 19 * 0.05 + 2.0, abs=0.06)
    assert rests(bench)
    bench = Bench()
    driver = Driver(bench, closes=lambda k: k % 20 > 5)  # fingers that open again held nothing
    assert run(bench, driver, rate_hz=20.0, hold_s=2.0, longest_s=5.0).end is End.TIME


def test_the_same_reading_is_answered_once_and_a_robot_that_gives_no_new_one_is_told_to_rest():
    bench = Bench(readings=lambda time: math.floor(time * 10.0 + 1e-6) / 10.0)
    driver = Driver(bench, takes=lambda k: 0.0)
    assert run(bench, driver, rate_hz=20.0, longest_s=2.0, stale_s=0.2).end is End.TIME
    assert driver.k + 1 == pytest.approx(20, abs=1)
    bench = Bench(readings=lambda time: min(time, 101.0))
    report = run(bench, Driver(bench), rate_hz=20.0, stale_s=0.2)
    assert report.end is End.STALE
    assert "no new reading for 0.2" in report.sentence
    assert bench.time == pytest.approx(101.26, abs=0.06)
    assert rests(bench)


def test_a_camera_that_gives_no_new_picture_ends_the_loop_though_joints_are_still_read():
    bench = Bench(pictures=lambda time: min(math.floor(time * 4.0 + 1e-6) / 4.0, 102.0))  # four a second, then none
    report = run(bench, Driver(bench), rate_hz=20.0, blind_s=0.5)
    assert report.end is End.STALE
    assert "no new picture for 0.5" in report.sentence
    assert bench.time == pytest.approx(102.0 + 0.5, abs=0.07)
    assert rests(bench)


def test_fingers_that_are_told_nothing_stay_as_they_were():
    bench = Bench()
    commands = iter([*[0.0] * 60, 1.0])
    driver = SimpleNamespace(
        percept=SimpleNamespace(fixation=SimpleNamespace(visible=True)),
        respond=lambda observation: Command(np.zeros(6), next(commands, 0.0)),
    )
    report = run(bench, driver, rate_hz=20.0, hold_s=2.0)
    assert report.end is End.HELD
    assert bench.time == pytest.approx(100.0 + 59 * 0.05 + 2.0, abs=0.06)  # from the one command to close


@pytest.mark.parametrize("error", [RuntimeError("camera unplugged"), KeyboardInterrupt()])
def test_the_robot_rests_after_an_exception_which_goes_on(error):
    bench = Bench()

    def takes(k):
        if k == 3:
            raise error
        return 0.01

    with pytest.raises(type(error)):
        run(bench, Driver(bench, takes=takes))
    assert len(bench.commands) == 4
    assert rests(bench)


def test_readings_that_go_back_in_time_are_refused():
    bench = Bench(readings=lambda time: 201.0 - time)
    with pytest.raises(UsageError, match=r"readings must go forward in time: .* came after"):
        run(bench, Driver(bench))
    assert rests(bench)


@pytest.mark.parametrize("twist", [np.full(6, math.nan), np.zeros(3)])
def test_a_motion_that_is_none_never_reaches_the_robot(twist):
    bench = Bench()
    driver = SimpleNamespace(percept=None, respond=lambda observation: Command(twist, 0.0))
    with pytest.raises(UsageError, match="a twist of 6 finite numbers"):
        run(bench, driver)
    assert len(bench.commands) == 1
    assert rests(bench)


@pytest.mark.parametrize("bad", [{"rate_hz": 0.0}, {"lost_s": math.nan}, {"hold_s": "4"}, {"longest_s": math.inf}])
def test_settings_that_are_none_are_refused_by_their_name(bad):
    with pytest.raises(UsageError, match=f"{next(iter(bad))} must be a number above 0"):
        LoopSettings(**bad)


def test_the_computers_clock_waits_until_a_time_and_not_at_all_for_one_that_is_over():
    clock = WallClock()
    start = clock.now()
    clock.wait_until(start - 1.0)
    clock.wait_until(start + 0.02)
    assert 0.02 <= clock.now() - start < 1.0
