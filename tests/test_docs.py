"""What the pages say about the repository is so: links lead somewhere, lines are short."""

import re
from pathlib import Path

import pytest

from fixation_gym.envs.config import SCENARIO_NAMES

ROOT = Path(__file__).parent.parent
OUTSIDE_THE_SITE = [ROOT / "README.md", ROOT / "CHANGELOG.md", *ROOT.glob("policies/**/*.md")]


@pytest.mark.parametrize("page", OUTSIDE_THE_SITE, ids=lambda page: page.name)
def test_links_of_the_pages_that_the_site_does_not_check_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#]+)", page.read_text())
    missing = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert not missing


def test_every_page_of_the_site_is_in_its_navigation():
    configuration = (ROOT / "mkdocs.yml").read_text()
    pages = {str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").glob("**/*.md")}
    assert pages == set(re.findall(r": (\S+\.md)$", configuration, re.MULTILINE))


def test_the_theory_page_agrees_with_the_code_in_every_sign():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "theory.md").read_text(), re.DOTALL)
    assert sum(block.count("assert") for block in blocks) >= 12
    exec(compile("\n".join(blocks), "theory.md", "exec"), {"__name__": "theory"})


def test_the_figures_of_the_theory_are_drawn_from_the_code(tmp_path):
    names = {"__name__": "theory_figures", "__file__": str(ROOT / "scripts" / "theory_figures.py")}
    exec(compile((ROOT / "scripts" / "theory_figures.py").read_text(), names["__file__"], "exec"), names)
    names["main"](tmp_path)
    drawn = {path.name for path in tmp_path.iterdir()}
    assert drawn == {f"{name}.svg" for name in names["FIGURES"]}
    pages = "".join(page.read_text() for page in (ROOT / "docs").glob("*.md"))
    assert all(f"images/{name}" in pages for name in drawn)


def test_version_and_paper_are_the_same_in_every_file_that_names_them():
    version = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)[1]
    citation, page = (ROOT / "CITATION.cff").read_text(), (ROOT / "docs" / "citing.md").read_text()
    assert f"\nversion: {version}\n" in citation
    assert f"version = {{{version}}}" in page
    (doi,) = re.findall(r"doi: (\S+)", citation)
    assert doi in page


def test_the_packages_say_that_they_are_typed():
    assert all((ROOT / folder / "py.typed").exists() for folder in ("fixation_gym", "policies/fixation_policies"))


def test_every_scenario_has_its_picture_on_the_page_of_scenarios():
    page = (ROOT / "docs" / "scenarios.md").read_text()
    assert sorted(re.findall(r"^### `(\w+)`$", page, re.MULTILINE)) == sorted(SCENARIO_NAMES)
    pictures = [ROOT / "docs" / "images" / "scenarios" / f"{name}.jpg" for name in SCENARIO_NAMES]
    assert all(f"(images/scenarios/{picture.name})" in page for picture in pictures)
    assert sum(picture.stat().st_size for picture in pictures) < 2e6


def test_the_readme_is_short_and_begins_with_what_one_can_do():
    lines = (ROOT / "README.md").read_text().splitlines()
    assert len(lines) < 120
    first_screen = "\n".join(lines[:45])
    assert all(part in first_screen for part in ("hero.gif", "make demo", "make test", "```python", "| the paper |"))


@pytest.mark.parametrize(
    ("in_readme", "page", "in_page"),
    [
        ("0.12 mm; with the paper's filter 0.95 mm", "distance", "filter (`pose`) | 0.12 mm |"),
        ("0.12 mm; with the paper's filter 0.95 mm", "distance", "twist and flow) | 0.95 mm |"),
        ("1.4 mm; with the paper's filter 31 mm", "distance", "0.12 mm | 1.4 mm |"),
        ("1.4 mm; with the paper's filter 31 mm", "distance", "0.95 mm | 31 mm |"),
        ("not reproduced: 110 %", "distance", "1.1 at 2 m with the 5 cm circle"),
        ("224 of 225 things; paper's rule 86 %", "scenarios", "| all | 225 | 0.58 | 0.44 | 0.86 | 1.00"),
        ("92 % of 1500", "baseline", "**all 1500** | **95.8** | **92.3**"),
        ("18 of 75; servo 73 of 75", "ladder", "one grasp | 28 | 18 |"),
        ("18 of 75; servo 73 of 75", "ladder", "a second try | 73 | 73 |"),
    ],
)
def test_numbers_of_the_readme_are_those_of_the_page_they_come_from(in_readme, page, in_page):
    text = (ROOT / "docs" / "results" / f"{page}.md").read_text()
    assert in_page in " ".join(text.split()), (
        f"the page has other numbers now: change them in README.md, too ({in_readme})"
    )
    assert in_readme in (ROOT / "README.md").read_text()


@pytest.mark.sim
@pytest.mark.parametrize("page", ["README.md", "docs/start.md"])
def test_the_ten_lines_of_a_page_lift_the_target(page, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    names = {"__name__": "ten_lines"}
    exec(compile(code, page, "exec"), names)
    names["env"].close()
    assert names["info"]["is_success"]
    assert "phase=" in capsys.readouterr().out


def test_every_command_has_a_row_on_the_page_of_commands():
    commands = re.findall(r'subcommand\("(\w+)"\)', (ROOT / "fixation_gym" / "cli.py").read_text())
    rows = re.findall(r"^\| `(\w+)", (ROOT / "docs" / "commands.md").read_text(), re.MULTILINE)
    assert sorted(rows) == sorted(commands)


def test_make_help_lists_every_target():
    makefile = (ROOT / "Makefile").read_text()
    targets = re.findall(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)[0].split()
    described = [
        name for names in re.findall(r"^([a-z][a-z_ -]*):[^#\n]*# ", makefile, re.MULTILINE) for name in names.split()
    ]
    assert sorted(described) == sorted(targets)


PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "docs" / "doors").glob("*.md"),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_lines_of_pages_are_of_120_columns_at_most(page):
    long = [line for line in page.read_text().splitlines() if len(line) > 120]
    assert not long
