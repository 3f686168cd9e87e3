"""The state of an environment in mid-episode as a value: taken, stored, carried to another process, set again."""

from __future__ import annotations

import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Any

from gymnasium.error import ResetNeeded

from fixation_gym.doctor import installed_versions


@dataclass(frozen=True)
class EnvState:
    """All that the rest of an episode depends on; see ``FixationPickEnv.get_state``. Pickle it to keep it."""

    written_by: str
    settings: Mapping[str, Any]
    """Arguments of the environment, but for those of rendering for people, and its robot."""
    contents: bytes
    """A pickle: set states from sources you trust only."""


@cache
def _written_by() -> str:
    """States are read by the versions that wrote them only: they hold the inside of simulation and perception."""
    versions = installed_versions()
    return f"fixation-gym {versions.get('fixation-gym', 'not installed')}, MuJoCo {versions.get('mujoco')}"


def pack(settings: Mapping[str, Any], parts: Mapping[str, Any]) -> EnvState:
    """A state that shares nothing with the environment that it is taken from."""
    return EnvState(_written_by(), dict(settings), pickle.dumps(parts))


def unpack(state: EnvState, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a state, for an environment with these settings.

    Raises:
        ValueError: if it is no state, of another version, or of another environment; the message says which.
    """
    if not isinstance(state, EnvState):
        raise ValueError(f"set_state needs what get_state returned, got {type(state).__name__}")
    if state.written_by != _written_by():
        raise ValueError(
            f"this state was written by {state.written_by}, but this is {_written_by()}; take it again here"
        )
    if state.settings.keys() != settings.keys():
        raise ValueError("this state is of another kind of environment: set it where it was taken, or in one like that")
    for name, value in settings.items():
        if state.settings[name] != value:
            there, here = _differing(state.settings[name], value)
            raise ValueError(f"this state is of an environment with {name}={there!r}, but this one has {here!r}")
    return pickle.loads(state.contents)


def _differing(there: Any, here: Any) -> tuple[Any, Any]:
    """Two settings that differ: of values with a name that, of others with fields those fields alone."""
    if getattr(there, "name", None) != getattr(here, "name", None):
        return there.name, here.name
    if not (is_dataclass(there) and type(there) is type(here)):
        return there, here
    names = [field.name for field in fields(there) if getattr(there, field.name) != getattr(here, field.name)]
    return {name: getattr(there, name) for name in names}, {name: getattr(here, name) for name in names}


class Resumable(ABC):
    """Gives an environment ``get_state`` and ``set_state``, and copies and pickles that go on in mid-episode."""

    spec: Any
    _running: bool
    """Between a reset and ``close``."""

    def get_state(self) -> EnvState:
        """All that the rest of the episode depends on: simulation, controller, generators, movers, perception inside.

        What wrappers keep is not in it: the steps that ``TimeLimit`` has counted, and that there was a reset, which
        ``OrderEnforcing`` asks for. So reset a wrapped environment once before you set a state.

        Raises:
            gymnasium.error.ResetNeeded: before the first reset, and after ``close``.
        """
        self._require_reset()
        return pack(self._state_settings(), self._episode())

    def set_state(self, state: EnvState) -> None:
        """Go on from a state, bit by bit as the environment that it was taken from, also in another process.

        Raises:
            ValueError: if it is of another version, or of an environment with other arguments.
        """
        self._continue(unpack(state, self._state_settings()))
        self._running = True

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles go on in mid-episode; simulation and views are built again."""
        state = self.get_state() if self._running else None
        return _made_again, (type(self), self._state_arguments(), state), {"spec": self.spec}

    def _require_reset(self) -> None:
        if not self._running:
            raise ResetNeeded("call reset() first: after gym.make, and again after close()")

    @abstractmethod
    def _state_arguments(self) -> dict[str, Any]:
        """Arguments that make another such environment."""

    @abstractmethod
    def _state_settings(self) -> dict[str, Any]:
        """What must be the same where a state is set."""

    @abstractmethod
    def _episode(self) -> dict[str, Any]:
        """All parts of the present state."""

    @abstractmethod
    def _continue(self, episode: dict[str, Any]) -> None:
        """Go on from such parts."""


def _made_again(make: Callable[..., Resumable], arguments: dict[str, Any], state: EnvState | None) -> Resumable:
    env = make(**arguments)
    if state is not None:
        env.set_state(state)
    return env
