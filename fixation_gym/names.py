"""Lists of names, as the command line takes them."""

from __future__ import annotations

from typing import Annotated

from tyro.constructors import PrimitiveConstructorSpec


def _split(text: str) -> tuple[str, ...]:
    """Split "a,b" into ("a", "b"); nothing gives no names."""
    return tuple(name.strip() for name in text.split(",")) if text else ()


Names = Annotated[
    tuple[str, ...],
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="STR",
        instance_from_str=lambda arguments: _split(arguments[0]),
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda names: [",".join(names)],
    ),
]
"""Names that a command takes as one argument, separated by commas."""
