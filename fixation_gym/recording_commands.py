"""The commands ``record`` and ``replay``; see ``cli``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fixation_gym.envs.config import EPISODE_SECONDS
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.gl import select_backend
from fixation_gym.replay.config import ReplayConfig


@dataclass(frozen=True)
class Record(EvaluationConfig):
    """Record a policy's episodes as pictures, poses and truth that replay takes. The same command again resumes."""

    out: Path = Path("out/record")
    """Folder of the recordings."""
    seconds: float | None = None
    """Length of the recordings, from the beginning of the episodes, s; by default to their ends."""

    def check(self) -> None:
        """Check everything that can be checked without building an environment.

        Raises:
            UsageError: naming the first bad value and what is allowed.
        """
        super().check()
        if self.seconds is not None and not 0.0 < self.seconds <= EPISODE_SECONDS:
            raise UsageError(f"--seconds must be above 0 and at most {EPISODE_SECONDS:g}, got {self.seconds}")

    def run(self) -> int:
        """Record and say where."""
        self.check()
        select_backend()
        from fixation_gym.recordings.record import record

        summary = record(self, self.out, self.seconds)
        print(f"{summary['pictures']} pictures\n\n" + "\n".join(str(self.out / name) for name in summary["recordings"]))
        return 0


@dataclass(frozen=True, kw_only=True)
class Replay(ReplayConfig):
    """Perception on recorded pictures of any camera whose poses are known: estimates, overlay video, scores."""

    out: Path = Path("out/replay")
    """Folder of the results; an earlier replay there is replaced."""

    def run(self) -> int:
        """Perceive and print what came out."""
        self.check()
        from fixation_gym.replay.notes import format_summary
        from fixation_gym.replay.run import FILES, replay

        print(format_summary(replay(self, self.out)))
        print("\n" + "\n".join(str(self.out / name) for name in FILES))
        return 0
