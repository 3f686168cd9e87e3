"""What ``mkdocs.yml`` cannot say: formulas become MathML, CSVs tables, and the changelog is read from where it is."""

import csv
import html
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert  # pyright: ignore[reportMissingImports]  # only the docs need it

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
_TABLE = re.compile(r"^<!-- table: (\S+) -->$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Put CHANGELOG.md in the place of the page that stands for it, and tables in the places of their names."""
    if page.file.src_uri == "changelog.md":
        return Path("CHANGELOG.md").read_text(encoding="utf-8").replace("](docs/", "](")
    return _TABLE.sub(lambda found: _table(Path("docs", found[1])), markdown)


def on_page_content(content: str, **_: Any) -> str:
    """Set formulas: browsers draw MathML by themselves, without a script from another server."""
    return _FORMULA.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    display = "block" if found[1] == "div" else "inline"
    return convert(html.unescape(found[2]), display=display)


def _table(path: Path) -> str:
    """A CSV as a table; names of code and tests are shortened, and shown in full where the mouse rests on them."""
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    lines = [head, ["---"] * len(head)]
    lines += [[_shown(kind, cell) for kind, cell in zip(head, row, strict=True)] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _shown(kind: str, cell: str) -> str:
    if kind == "code":
        return f'<code title="{cell}">{cell.rsplit(".", 1)[-1]}</code>'
    if kind == "test":
        sentence = cell.rsplit("::test_", 1)[-1].replace("_", " ")
        return f'<span title="{cell}">{sentence}</span>'
    return cell
