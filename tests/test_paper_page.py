"""The table from the paper to the code names things that exist."""

import csv
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
with (ROOT / "docs" / "paper-to-code.csv").open() as file:
    ROWS = list(csv.DictReader(file))
IDS = [f"{row['paper']}: {row['what it says']}" for row in ROWS]


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_the_code_of_a_row_can_be_imported(row):
    module, name = row["code"].rsplit(".", 1)
    assert hasattr(import_module(module), name)


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_the_test_of_a_row_is_there(row):
    path, name = row["test"].split("::")
    assert re.search(rf"^def {name}\(", (ROOT / path).read_text(), re.MULTILINE)


@pytest.mark.parametrize("row", ROWS, ids=IDS)
def test_the_page_of_a_result_is_there(row):
    pages = re.findall(r"\]\(([^)#]+)", row["result"])
    assert all((ROOT / "docs" / page).is_file() for page in pages)


def test_every_equation_of_the_paper_has_a_row_and_every_verdict_its_meaning():
    equations = [
        int(number) for row in ROWS if row["paper"].startswith("Eq") for number in re.findall(r"\d", row["paper"])
    ]
    assert set(equations) == set(range(1, 9))
    meanings = re.findall(r"^\| ([^|]+?) \| \w", (ROOT / "docs" / "paper.md").read_text(), re.MULTILINE)
    assert {row["here"] for row in ROWS} == set(meanings)
