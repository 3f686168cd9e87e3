"""The state of an environment in mid-episode as a value: taken, stored, carried to another process, set again."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

_FORMAT = f"fixation-gym {version('fixation-gym')}, MuJoCo {version('mujoco')}"
"""States are read by the versions that wrote them only: what they hold is the inside of simulation and perception."""


@dataclass(frozen=True)
class EnvState:
    """All that the rest of an episode depends on; see ``FixationPickEnv.get_state``. Pickle it to keep it."""

    written_by: str
    settings: Mapping[str, Any]
    """Arguments of the environment, but for those of rendering for people."""
    contents: bytes
    """A pickle: set states from sources you trust only."""


def pack(settings: Mapping[str, Any], parts: Mapping[str, Any]) -> EnvState:
    """A state that shares nothing with the environment that it is taken from."""
    return EnvState(_FORMAT, dict(settings), pickle.dumps(parts))


def unpack(state: EnvState, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a state, for an environment with these settings.

    Raises:
        ValueError: if it is no state, of another version, or of another environment; the message says which.
    """
    if not isinstance(state, EnvState):
        raise ValueError(f"set_state needs what get_state returned, got {type(state).__name__}")
    if state.written_by != _FORMAT:
        raise ValueError(f"this state was written by {state.written_by}, but this is {_FORMAT}; take it again here")
    if state.settings.keys() != settings.keys():
        raise ValueError("this state is of another kind of environment: set it where it was taken, or in one like that")
    for name, value in settings.items():
        if state.settings[name] != value:
            raise ValueError(
                f"this state is of an environment with {name}={state.settings[name]!r}, but this one has {value!r}"
            )
    return pickle.loads(state.contents)
