"""The table of problems that tests share: requests by name, in `questions/<kind>.jsonl`."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any

from tests.suite.comparison import Difference, differences

__all__ = ["Problem", "problem", "problems"]

QUESTIONS = Path(__file__).parent / "questions"


@dataclass(frozen=True)
class Problem:
    """A question of the suite.

    Attributes
    ----------
    kind : str
        The file that it is in.
    name : str
        Unique within its kind.
    ask : dict
        What is asked, as `adapter.ask` takes it.
    slow : bool
        Whether it takes more than about two seconds.
    full : bool
        Whether the answer keeps places and axes of tiles, and sets row by row.
    tolerance : float
        Of numbers, relative to the largest of their kind in the answer.
    loose : dict of str to tuple of (float or None, str)
        Fields of the answer with a tolerance of their own, null where they are not compared, and
        why: where an answer is not unique, or badly conditioned. ``*`` is the whole answer.
    """

    kind: str
    name: str
    ask: dict[str, Any]
    slow: bool = False
    full: bool = False
    tolerance: float = 1e-9
    loose: dict[str, tuple[float | None, str]] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Kind and name."""
        return f"{self.kind}/{self.name}"

    def changes(self, expected: Any, got: Any, least: float = 0.0) -> list[Difference]:
        """Return the differences between two answers that are more than rounding, largest first.

        ``least``: the least tolerance of any number.
        """
        found = sorted(differences(expected, got), key=lambda each: -each.size)
        return [each for each in found if not each.size <= max(least, self.allowed(each.names))]

    def allowed(self, names: Iterable[str]) -> float:
        """Return how far a number in fields of these names may be off, relative to its kind."""
        sizes = [self.loose[name][0] for name in ("*", *names) if name in self.loose]
        return max([self.tolerance, *(math.inf if size is None else size for size in sizes)])

    @property
    def request(self) -> dict[str, Any]:
        """The message that is asked: a plan request, or that of another key."""
        asked = ("plan", "wrench_space", "body_space", "stream", "stdin")
        return next(self.ask[name] for name in asked if name in self.ask)


@cache
def _table() -> dict[str, Problem]:
    own = ("name", "slow", "full", "tolerance", "loose")
    found = []
    for file in sorted(QUESTIONS.glob("*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines():
            fields = json.loads(line)
            ask = {key: value for key, value in fields.items() if key not in own}
            about = {key: value for key, value in fields.items() if key in own}
            found.append(Problem(kind=file.stem, ask=ask, **about))
    table = {each.label: each for each in found}
    assert len(table) == len(found), "names are not unique"
    return table


def problem(label: str) -> Problem:
    """Return a problem by its kind and name, as ``pinches/cylinder-300``."""
    return _table()[label]


def problems(pattern: str = "*") -> Iterator[Problem]:
    """Yield the problems whose kind, name, or both with a slash between match a pattern."""
    for each in _table().values():
        if any(fnmatch(text, pattern) for text in (each.kind, each.name, each.label)):
            yield each
