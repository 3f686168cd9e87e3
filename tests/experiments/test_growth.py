"""What ``bench --growth`` makes of its measurements; the real ones are made by the command itself."""

import json
import os
import subprocess

import cv2
import pytest

from fixation_gym.experiments.bench import first_use, worker_speed
from fixation_gym.experiments.bench.growth import format_growth
from fixation_gym.experiments.bench.growth_figure import draw_growth

FOUND = {
    "first_use": {"after the first reset, MB": 380.0},
    "sizes": [{"name": name, "ms_median": 2.0, "ms_p95": 3.0} for name in ("no image", "128x128", "320x240")],
    "obstacles": [
        {"name": f"{n} obstacles, {size}", "ms_median": 1.0 + n, "ms_p95": 2.0 + n}
        for size in ("no image", "128x128")
        for n in (0, 8)
    ],
    "episode": [{"step": step, "act_ms": 4.25, "step_ms": 7.0, "calls": 50} for step in (0, 25)],
    "resets": [{"name": "opaque", "ms_median": 4.0, "ms_mean": 7.5, "ms_max": 30.0, "resets": 100}],
    "workers": [
        {"kind": kind, "workers": n, "steps_per_s": 100.0 * n, "mb_each": 285.0}
        for n in (1, 2)
        for kind in ("gym.make_vec", "SubprocVecEnv")
    ],
}


def test_the_table_names_every_measurement_once():
    lines = format_growth(FOUND).splitlines()
    for expected in (
        "after the first reset, MB 380.0",
        "320x240 2.00 3.00",
        "8 obstacles, 128x128 9.00 10.00",
        "opaque 4.0 7.5 30.0",
        "25 4.25 7.00",
        "SubprocVecEnv, 2 200.0 285",
    ):
        assert [" ".join(line.split()) for line in lines].count(expected) == 1


def test_the_charts_are_a_picture_of_readable_size(tmp_path):
    draw_growth(tmp_path / "growth.png", FOUND)
    image = cv2.imread(str(tmp_path / "growth.png"))
    assert image is not None
    assert image.shape[1] == 880
    assert image.std() > 10


def test_first_use_leaves_out_the_process_that_fills_the_caches(monkeypatch):
    seconds = iter([90.0, 3.0, 1.0, 2.0, 5.0, 4.0])

    def answer(command, **_):
        return subprocess.CompletedProcess(command, 0, f"said by a library\n{json.dumps({'s': next(seconds)})}\n")

    monkeypatch.setattr(first_use.subprocess, "run", answer)
    assert first_use.first_use() == {"s": 3.0}


def test_a_process_has_the_memory_that_it_wrote():
    before = worker_speed._proportional_mb(os.getpid())
    written = bytearray(os.urandom(1)) * (64 << 20)
    assert worker_speed._proportional_mb(os.getpid()) - before == pytest.approx(64.0, abs=8.0)
    assert len(written) == 64 << 20
