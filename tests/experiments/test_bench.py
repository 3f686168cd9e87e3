"""The benchmark's bookkeeping on made-up cases; the real ones are timed by the command itself."""

from itertools import count

import cv2
import numpy as np
import pytest

from fixation_gym.experiments.bench import groups as bench_groups
from fixation_gym.experiments.bench import run as bench
from fixation_gym.experiments.bench.figure import draw_figure
from fixation_gym.experiments.bench.groups import Case, LocalGroup


def test_cases_of_all_groups_are_interleaved_and_every_call_is_timed(monkeypatch):
    order, clock = [], count()
    monkeypatch.setattr(bench_groups.time, "perf_counter", lambda: float(next(clock)))  # every call takes one second
    groups = [LocalGroup([Case(name, lambda name=name: order.append(name)) for name in names]) for names in ("ab", "c")]
    rows = bench.measure(groups, rounds=3)
    assert order[-9:] == ["a", "b", "c"] * 3
    assert [row["name"] for row in rows] == ["a", "b", "c"]
    assert all(row["calls"] == 3 and row["ms_median"] == 1000.0 for row in rows)


def test_a_case_that_draws_nothing_is_refused():
    group = LocalGroup([Case("blank", lambda: np.full((4, 4, 3), 7, np.uint8))])
    with pytest.raises(RuntimeError, match="'blank' shows nothing"):
        group.time(0, 0.0)


def test_ratios_need_both_sides_and_know_their_direction():
    def rows(**times):
        return [{"name": name.replace("_", " "), "ms_median": ms, "ms_p95": ms} for name, ms in times.items()]

    ratios = bench.ratios_of(rows(lift_step_128x128=40.0, step_128x128=4.0, flow_640x480=3.0))
    assert list(ratios) == ["robosuite Lift step / ours, 128x128 image"]
    assert next(iter(ratios.values())) == {"value": 10.0, "goal": 10.0, "at_most": False, "met": True}
    slow = bench.ratios_of([*rows(flow_640x480=3.0), {"name": "DIS ultrafast 640x480", "ms_median": 2.0, "ms_p95": 2}])
    assert slow["optic flow / DIS ultrafast, 640x480"]["value"] == pytest.approx(1.5)
    assert not slow["optic flow / DIS ultrafast, 640x480"]["met"]


def test_the_chart_is_a_picture(tmp_path):
    draw_figure(
        tmp_path / "bench.png", [{"name": f"case {i}", "ms_median": 1.0 + i, "ms_p95": 2.0 + i} for i in range(5)]
    )
    image = cv2.imread(str(tmp_path / "bench.png"))
    assert image is not None
    assert image.std() > 10
