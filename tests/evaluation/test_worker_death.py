"""A worker process that dies."""

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
