"""Environments in worker processes, behind ``gym.make_vec("FixationPick-v0", num_envs=4)``.

Gymnasium's ``AsyncVectorEnv``, with what these environments need: workers are started afresh, since GL does not survive
a fork; each has one thread, since more only get into each other's way; every wait has an end; and what goes wrong in a
worker is said here, with its traceback.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
from collections.abc import Iterable, Iterator
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import gymnasium as gym
from gymnasium.vector import AsyncVectorEnv, AutoresetMode

from fixation_gym.gl import select_backend

WAIT_S = 600.0
"""Longest wait for a worker, s: on a busy machine the first reset of a fresh installation compiles for minutes."""
_CLOSE_S, _ERROR_S = 10.0, 10.0
"""Longest waits for a worker that is to end, and for the error of one that failed, s."""
_ONE_THREAD = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"),
    *("NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"),
)
"""Libraries read these when they are loaded, so a worker must have them from its start."""
_GONE = (EOFError, ConnectionError)
"""What a pipe says when the process at its other end is gone."""


class WorkerError(RuntimeError):
    """A worker failed, ended or did not answer in time. The message says what happened; all workers are ended."""


class WorkerEnvs(AsyncVectorEnv):
    """Environments in a process each; observations come through shared memory, bit by bit those of single ones.

    Seeds, autoreset modes and ``info`` are those of ``AsyncVectorEnv``. A script makes it under
    ``if __name__ == "__main__":``, as all that starts processes afresh.
    """

    def __init__(
        self,
        env_id: str,
        num_envs: int,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        wait_s: float = WAIT_S,
        **arguments: Any,
    ) -> None:
        """Start the workers.

        Args:
            env_id: of the environment, as registered.
            num_envs: number of workers, at least 1.
            autoreset_mode: what a worker does when its episode has ended.
            wait_s: longest wait for a worker, s.
            arguments: of ``gymnasium.make``, which checks them.

        Raises:
            ValueError: for a value that is not allowed; the message says what is.
            MissingGLError: if nothing can render here.
            WorkerError: if a worker does not start.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, got {num_envs}")
        if not wait_s > 0.0:
            raise ValueError(f"wait_s must be above 0, got {wait_s}")
        _make(env_id, arguments).close()  # wrong arguments are said before anything is started
        select_backend()  # once, and not in every worker
        self._wait_s = wait_s
        makers = [partial(_make, env_id, arguments) for _ in range(num_envs)]
        with self._told(), _one_thread():
            super().__init__(makers, context="spawn", autoreset_mode=autoreset_mode)

    def _check_spaces(self) -> None:
        """First talk to the workers, at the end of the base's constructor: from here on no wait is endless."""
        patient: Any = [_Patient(pipe, self._wait_s) for pipe in self.parent_pipes]
        self.parent_pipes = patient
        super()._check_spaces()

    def reset_wait(self, timeout: float | None = None) -> tuple[Any, dict[str, Any]]:
        """See ``AsyncVectorEnv.reset_wait``.

        Raises:
            WorkerError: if a worker ended or did not answer. What an environment raises is raised as it is.
        """
        with self._told():
            return super().reset_wait(timeout)

    def step_wait(self, timeout: float | None = None) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """See ``AsyncVectorEnv.step_wait`` and, for errors, ``reset_wait``."""
        with self._told():
            return super().step_wait(timeout)

    def call_wait(self, timeout: float | None = None) -> tuple[Any, ...]:
        """See ``AsyncVectorEnv.call_wait`` and, for errors, ``reset_wait``."""
        with self._told():
            return super().call_wait(timeout)

    def close_extras(self, timeout: float | None = None, terminate: bool = False) -> None:
        """End the workers; those that do not answer are killed."""
        pipes: list[Any] = [pipe for pipe in self.parent_pipes if pipe is not None]
        if not terminate:
            for pipe in pipes:
                pipe.wait_s = _CLOSE_S
            with contextlib.suppress(WorkerError, multiprocessing.TimeoutError, *_GONE):
                super().close_extras(timeout)
                return
        for process in self.processes:
            process.kill()  # one that hangs or was stopped does not hear anything less
            process.join()
        for pipe in pipes:
            pipe.close()

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Whatever ends the talk with the workers ends them all, and is told in a sentence."""
        try:
            yield
        except multiprocessing.TimeoutError:
            self._end()
            raise WorkerError(
                f"a worker did not answer within {self._wait_s:g} s: the machine is too busy, or the graphics driver "
                "hangs; wait_s=... of gym.make_vec allows more"
            ) from None
        except _GONE:
            self._end()
            raise WorkerError(
                "a worker process ended: killed, out of memory, or a crash of the graphics driver; what it said is "
                'above. A script makes workers under `if __name__ == "__main__":`'
            ) from None

    def _raise_if_errors(self, successes: Iterable[bool]) -> None:
        """Raise what a worker raised, with its traceback as the cause."""
        if all(successes):
            return
        try:
            index, _, error, trace = self.error_queue.get(timeout=_ERROR_S)
        except queue.Empty:
            index, error, trace = "?", None, "its error cannot be carried over and is printed above"
        self._end()
        raise error or WorkerError("a worker failed") from WorkerError(f"in worker {index}:\n{trace}")

    def _end(self) -> None:
        self.close(terminate=True)


class _Patient:
    """The pipe to a worker, on which no wait is endless."""

    def __init__(self, pipe: Connection, wait_s: float) -> None:
        self._pipe, self.wait_s = pipe, wait_s

    @property
    def closed(self) -> bool:
        return self._pipe.closed

    def send(self, message: Any) -> None:
        self._pipe.send(message)

    def poll(self, timeout: float | None = 0.0) -> bool:
        return self._pipe.poll(timeout)

    def recv(self) -> Any:
        if not self._pipe.poll(self.wait_s):
            raise multiprocessing.TimeoutError
        return self._pipe.recv()

    def close(self) -> None:
        self._pipe.close()


def _make(env_id: str, arguments: dict[str, Any]) -> gym.Env[Any, Any]:
    return gym.make(env_id, **arguments)  # a new process has the ids, since it imports this package


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    """Processes that are started meanwhile have one thread per library, unless the user chose another number."""
    missing = [name for name in _ONE_THREAD if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]


pick_workers = partial(WorkerEnvs, "FixationPick-v0")
zfc_workers = partial(WorkerEnvs, "FixationPickZFC-v0")
