"""Groups of benchmark cases, each in a process of its own that is told when to run.

Environments that share a process share GL contexts, and some leave another's context current: then they draw nothing,
quickly. In a process of its own each is timed as its user runs it.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol

import cv2
import numpy as np

_PATIENCE_S = 10.0
"""Time for a process to end by itself, s."""


@dataclass(frozen=True)
class Case:
    """One thing to time: ``run`` does it once, and returns the picture if it makes one."""

    name: str
    run: Callable[[], Any]
    close: Callable[[], Any] = lambda: None


class Group(Protocol):
    """Cases that are timed in the same process."""

    @property
    def names(self) -> Sequence[str]:
        """Of the cases, in order."""
        ...

    def time(self, index: int, seconds: float) -> list[float]:
        """Run a case as often as fits into that time, at least once and at most 50 times; seconds of each call."""
        ...

    def close(self) -> None:
        """Free what the cases hold."""
        ...


class LocalGroup:
    """Cases in this process."""

    def __init__(self, cases: Iterable[Case]) -> None:
        """Warm up."""
        self._cases = list(cases)
        self._duration = [self._warm_up(case) for case in self._cases]

    @staticmethod
    def _warm_up(case: Case) -> float:
        for _ in range(3):
            case.run()
        begin = time.perf_counter()
        case.run()
        return time.perf_counter() - begin

    @property
    def names(self) -> Sequence[str]:
        """Of the cases, in order."""
        return [case.name for case in self._cases]

    def time(self, index: int, seconds: float) -> list[float]:
        """Time one case.

        Raises:
            RuntimeError: if the case makes pictures, and this one shows nothing.
        """
        case, times = self._cases[index], []
        result = None
        for _ in range(int(np.clip(seconds / self._duration[index], 1, 50))):
            begin = time.perf_counter()
            result = case.run()
            times.append(time.perf_counter() - begin)
        if isinstance(result, np.ndarray) and not np.ptp(result) > 0:
            raise RuntimeError(f"the picture of {case.name!r} shows nothing, so its time means nothing")
        return times

    def close(self) -> None:
        """Close the cases."""
        for case in self._cases:
            case.close()


class ProcessGroup:
    """Cases in a new process."""

    def __init__(self, build: Callable[[], Iterable[Case]]) -> None:
        """Start the process.

        Args:
            build: makes the cases there; a function at the top of a module.
        """
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, build), daemon=True)
        self._process.start()
        theirs.close()
        self._names: Sequence[str] = self._answer()

    @property
    def names(self) -> Sequence[str]:
        """Of the cases, in order."""
        return self._names

    def time(self, index: int, seconds: float) -> list[float]:
        """Time one case there.

        Raises:
            RuntimeError: if the process failed.
        """
        return self._answer((index, seconds))

    def _answer(self, request: tuple[int, float] | None = None) -> Any:
        try:
            if request is not None:
                self._connection.send(request)
            return self._connection.recv()
        except (EOFError, OSError):
            raise RuntimeError("a process of the benchmark failed; its message is above") from None

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            self._connection.send(None)
        self._process.join(_PATIENCE_S)
        self._process.terminate()


def _serve(connection: Connection, build: Callable[[], Iterable[Case]]) -> None:
    """Body of the process of a ``ProcessGroup``."""
    cv2.setNumThreads(1)
    group = LocalGroup(build())
    connection.send(group.names)
    while (request := connection.recv()) is not None:
        connection.send(group.time(*request))
    group.close()
