"""What the pages say about the repository is so: links lead somewhere, lines are short."""

import re
from pathlib import Path

import pytest

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
