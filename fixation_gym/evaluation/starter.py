"""Worker processes end soon after the one that started them, however that one ended."""

from __future__ import annotations

import os
import threading
import time

_WATCH_S = 0.5
"""How often a worker looks whether the process that started it is there, s."""


def end_with(starter: int) -> None:
    """Let this worker process end soon after the one that started it: nobody would take its results.

    A worker that waits for work, or builds an environment, does not notice that by itself: it would stay there for
    minutes. One that works would write into a folder in which the same command goes on.

    Args:
        starter: id of that process.
    """

    def watch() -> None:
        while os.getppid() == starter:
            time.sleep(_WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="watch the starter").start()
