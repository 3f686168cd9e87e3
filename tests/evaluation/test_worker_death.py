"""Workers that die, or cannot be had."""

import os
import signal

import pytest

from fixation_gym.errors import UsageError
from fixation_gym.evaluation.workers import run_cells


def die_at_two(cell):
    if cell["number"] == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return cell


def test_a_killed_worker_ends_with_one_sentence():
    cells = [{"number": number} for number in range(4)]
    with pytest.raises(UsageError, match="the same command goes on"):
        list(run_cells(cells, 2, run=die_at_two))


def test_an_address_without_a_ray_cluster_is_named(monkeypatch):
    monkeypatch.setenv("RAY_ADDRESS", "nowhere")
    with pytest.raises(UsageError, match="there is no Ray cluster at RAY_ADDRESS=nowhere; start or unset it"):
        list(run_cells([{}], 2, "ray", dict))
