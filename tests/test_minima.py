"""The oldest dependencies that are admitted are those that the tests are run with."""

from __future__ import annotations

import tomllib

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

from tests.suite.helpers.checkout import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = ("scans", "test", "bench", "docs")  # the linters read the newest types


def only(specifier: SpecifierSet, operator: str) -> Version:
    (version,) = (part.version for part in specifier if part.operator == operator)
    return Version(version)


def test_the_oldest_that_are_admitted_are_those_that_are_tested() -> None:
    lines = (ROOT / ".ci" / "oldest.txt").read_text("utf-8").splitlines()
    pins = [Requirement(text) for line in lines if (text := line.partition("#")[0].strip())]
    pinned = {canonicalize_name(pin.name): only(pin.specifier, "==") for pin in pins}
    assert len(pinned) == len(pins)

    asked = list(PROJECT["dependencies"])
    for extra in EXTRAS:
        asked += PROJECT["optional-dependencies"][extra]
    minima = {
        canonicalize_name(requirement.name): only(requirement.specifier, ">=")
        for requirement in map(Requirement, asked)
    }
    assert {name: pinned.get(name) for name in minima} == minima
