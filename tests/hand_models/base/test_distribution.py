"""The name under which packages are installed, and what messages and documents say to install."""

from __future__ import annotations

import re
import tomllib

import pytest

from hand_models.base import DISTRIBUTION_NAME, installed_version, to_install
from tests.suite.helpers.checkout import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = set(PROJECT["optional-dependencies"])
TEXTS = [
    *(ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / ".ci" / "run"),
    *sorted(ROOT.glob("docs/**/*.md")),
    *(
        path
        for room in ("hand_models", "planner", "service")
        for path in ROOT.glob(f"{room}/**/*.py")
    ),
    *sorted(path for path in ROOT.glob("examples/**/*") if path.is_file()),
]
INSTALLED = re.compile(r"pip3? install (?:-\S+ )*(['\"]?[^'\"`\s]+['\"]?)")
ELSEWHERE = re.compile(r"\binstall\b[^\n]*\b(?:crux|crux-climb)\[")


def test_the_name_is_that_of_the_project() -> None:
    assert PROJECT["name"] == DISTRIBUTION_NAME
    assert installed_version() == PROJECT["version"]
    assert installed_version("no-distribution-of-this-name") is None


def test_the_command_and_what_is_imported_keep_their_names() -> None:
    assert PROJECT["scripts"] == {"crux": "service.__main__:main"}


@pytest.mark.parametrize("extra", sorted(EXTRAS))
def test_an_extra_is_installed_from_a_checkout(extra: str) -> None:
    assert to_install(extra).endswith(f"pip install -e '.[{extra}]'")


def test_every_extra_that_a_text_names_is_one() -> None:
    named = set()
    for path in TEXTS:
        for extras in re.findall(r"'\.\[([\w,]+)\]'", path.read_text("utf-8")):
            named |= {*extras.split(",")}
        for extra in re.findall(r"to_install\(['\"](\w+)['\"]\)", path.read_text("utf-8")):
            named.add(extra)
    assert {"parquet", "dask", "scans", "test", "docs"} <= named <= EXTRAS


def test_nothing_is_said_to_be_on_the_index_of_packages() -> None:
    """The name `crux` there is of another project, and this one is nowhere but in its checkout."""
    for path in TEXTS:
        text = path.read_text("utf-8")
        assert not ELSEWHERE.search(text), path
        targets = {target.strip("'\"") for target in INSTALLED.findall(text)}
        assert not targets & {"crux", DISTRIBUTION_NAME}, path
