"""The messages that docs/troubleshooting.md explains are messages of the code."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCES = [ROOT / "fixation_gym", ROOT / "policies"]
QUOTED = re.findall(r"^### `(.+)`$", (ROOT / "docs" / "troubleshooting.md").read_text(), re.MULTILINE)


def literal(node):
    """Text of a string in the source, with a mark where a value is put in."""
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    return "".join(str(part.value) if isinstance(part, ast.Constant) else "\0" for part in parts)


@cache
def messages():
    """All strings of the package and the lines of the installation script."""
    paths = [path for folder in SOURCES for path in folder.rglob("*.py")]
    nodes = (node for path in paths for node in ast.walk(ast.parse(path.read_text())))
    found = [literal(node) for node in nodes if isinstance(node, (ast.JoinedStr, ast.Constant))]
    script = re.sub(r"\$\([^)]*\)|\$\{[^}]*\}|\$\w+", "\0", (ROOT / "scripts" / "bootstrap.sh").read_text())
    return [*found, *script.splitlines()]


@pytest.mark.parametrize("text", QUOTED)
def test_a_quoted_message_is_one_of_the_code(text):
    pieces = [re.escape(piece) for piece in text.split("...")]
    pattern = re.compile("[^.;]*\0[^.;]*".join(pieces) if len(pieces) > 1 else pieces[0])
    assert any(pattern.search(message) for message in messages())


def test_every_part_of_the_program_has_its_messages():
    assert len(QUOTED) >= 25
    assert len(QUOTED) == len(set(QUOTED))
