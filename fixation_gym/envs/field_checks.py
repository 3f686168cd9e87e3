"""Values given as mappings, and checks of their fields; each raises a ``ValueError`` that says what is allowed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Value = TypeVar("Value", bound="DataclassInstance")


def with_fields(base: Value, changes: Mapping[str, Any], what: str, *others: str) -> Value:
    """A frozen value with fields of a mapping, which may come from JSON: lists stand for tuples.

    Args:
        base: the value to change.
        changes: new values by field.
        what: what messages call the fields.
        others: what else the mapping might have held.
    """
    known = [field.name for field in fields(base)]
    unknown = [name for name in changes if name not in known]
    if unknown:
        raise ValueError(f"unknown {what} {unknown}; choose from {[*others, *known]}")
    tuples = {name: tuple(value) for name, value in changes.items() if isinstance(value, list)}
    return replace(base, **{**changes, **tuples})


def require_names(field: str, names: tuple[str, ...], allowed: tuple[str, ...]) -> None:
    """Check a list of names."""
    if not isinstance(names, (tuple, list)):
        raise ValueError(f"{field} must be a list of names from {list(allowed)}, got {names!r}")
    unknown = [name for name in names if name not in allowed]
    if unknown:
        raise ValueError(f"unknown {field} {unknown}; choose from {list(allowed)}")


def require_range(field: str, values: tuple[float, float], lowest: float, highest: float) -> None:
    """Check a pair (low, high) of numbers."""
    pair = isinstance(values, (tuple, list)) and len(values) == 2
    if not pair or not all(isinstance(value, (int, float)) for value in values):
        raise ValueError(f"{field} must be two numbers (low, high), got {values!r}")
    if not lowest <= values[0] <= values[1] <= highest:
        raise ValueError(f"{field} must be (low, high) within {lowest}..{highest}, got {values}")


def require_shape(field: str, values: tuple[float, float]) -> None:
    """Check the exponents of a beta distribution; beyond these bounds it would be nearly one value."""
    pair = isinstance(values, (tuple, list)) and len(values) == 2
    if not pair or not all(isinstance(value, (int, float)) and 0.2 <= value <= 5.0 for value in values):
        raise ValueError(f"{field} must be two numbers within 0.2..5, got {values!r}")


def require_number(field: str, value: float, lowest: float, highest: float) -> None:
    """Check a number."""
    if not isinstance(value, (int, float)) or not lowest <= value <= highest:
        raise ValueError(f"{field} must be a number within {lowest:g}..{highest:g}, got {value!r}")
