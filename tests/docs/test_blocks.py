"""What the README and the documents show is what happens."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.docs.blocks import NOT_RUN, PAGES, SET_UP, Reader, alike, blocks, not_printed
from tests.suite.helpers.checkout import ROOT

README = ROOT / "README.md"


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if any(b.runs for b in blocks(p))], ids=named)
def test_a_page_is_as_it_says(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Reader(tmp_path).read(page)


def test_every_block_is_run_checked_or_marked():
    for page in PAGES:
        for block in blocks(page):
            assert block.language in ("sh", "python", "json", "toml", "text"), block
            if block.language in ("json", "toml"):
                # the file that it is
                assert re.fullmatch(r"[\w-]+\.(json|toml)", block.caption), block
            if block.language == "python":
                compile(block.text, named(page), "exec")


def test_few_blocks_are_not_run():
    marked = [block.caption for page in PAGES for block in blocks(page) if block.not_run]
    assert all(len(caption) > len(NOT_RUN) for caption in marked)
    assert len(marked) <= 14


def test_links_lead_to_files():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text("utf-8")):
            if not target.startswith("http") and "generated/" not in target:
                assert (page.parent / target).exists(), target


def test_the_readme_is_short_and_its_two_commands_are_a_line_each():
    assert len(README.read_text("utf-8").splitlines()) <= 200
    commands = [block.text for block in blocks(README) if block.text.startswith(SET_UP)]
    assert [command.split()[-1] for command in commands] == ["demo", "pytest"]
    assert all(command.count("\n") == 1 for command in commands)


def test_the_first_release_of_the_changelog_is_the_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    # what is not released yet stands above it
    assert next(heading for heading in headings if heading != "Unreleased") == version


def test_a_line_that_is_not_printed_is_found():
    printed = "OPTIMAL   utilisation 0.956   8 ms\nload factor 1.044\n"
    assert not_printed("OPTIMAL utilisation 0.96 13 ms\nload factor 1.05", printed) is None
    assert not_printed("load factor 1.04\nOPTIMAL utilisation 0.96 13 ms", printed) == (
        "OPTIMAL utilisation 0.96 13 ms"
    )
    assert not alike("load factor 1.10", "load factor 1.044")
    assert not alike("holds in 17 of 30 draws", "holds in 15 of 30 draws")
