"""Result of a study: data, and claims of the paper beside what the model gives."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, Literal, TypeAlias, TypeVar

from hand_models.base import Progress

__all__ = ["Claim", "Role", "StudyResult", "StudyText", "part", "track"]

Item = TypeVar("Item")

Role: TypeAlias = Literal["test", "calibration"]
"""Whether a claim tests the model, or a parameter was fitted to it."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, and what the model gives.

    Attributes
    ----------
    claim : str
        In the paper's words, or close to them, with the place.
    claimed, got : str or float
        The paper's figure and ours.
    holds : bool
    role : {'test', 'calibration'}
        Whether a parameter was fitted to the claim, so that it proves nothing.
    """

    claim: str
    claimed: str | float
    got: str | float
    holds: bool
    role: Role = "test"


@dataclass(frozen=True)
class StudyResult:
    """Result of a study.

    Attributes
    ----------
    name, title : str
        Its name, such as ``fig06``, and what it is about.
    data : dict
        The figure's data, SI units: what JSON can write, and arrays. ``not_tested``, if there,
        lists in words what the paper says and nothing published can decide; ``summary`` what else
        a person should read.
    claims : tuple of Claim
    hand : dict
        By section and name, the entries in which the hand is not the bundled one; filled in by
        `run_study`.
    """

    name: str
    title: str
    data: dict[str, Any]
    claims: tuple[Claim, ...]
    hand: dict[str, dict[str, Any]] = field(default_factory=dict)


class StudyText:
    """The words of a study in ``studies.toml``, and its claims as they are checked.

    Parameters
    ----------
    study : str
        Its table there.

    Attributes
    ----------
    claims : list of Claim
        Those checked so far.
    """

    def __init__(self, study: str) -> None:
        text = resources.files(__package__).joinpath("studies.toml").read_text("utf-8")
        self._name, self._words = study, tomllib.loads(text)[study]
        self.claims: list[Claim] = []

    def check(
        self,
        name: str,
        got: str | float,
        holds: object,
        *,
        claimed: float | None = None,
        role: Role | None = None,
        **values: Any,
    ) -> None:
        """Add a claim by its name.

        Parameters
        ----------
        name : str
        got : str or float
            What the model gives.
        holds : bool
        claimed : float, optional
            The paper's figure, of a claim that has it from a parameter.
        role : {'test', 'calibration'}, optional
            In place of the entry's, which is ``test`` where it has none.
        **values
            Of the placeholders in its words.
        """
        entry = self._words["claims"][name]
        paper: str | float = entry["claimed"] if claimed is None else claimed
        if isinstance(paper, str):
            paper = paper.format(**values)
        role = role or entry.get("role", "test")
        self.claims.append(Claim(entry["claim"].format(**values), paper, got, bool(holds), role))

    def label(self, axes: Any, name: str, **values: Any) -> None:
        """Write title and labels of axes by their name; ``values`` are of the placeholders."""
        axes.set(**{key: text.format(**values) for key, text in self._words["axes"][name].items()})

    def result(self, data: dict[str, Any]) -> StudyResult:
        """Return the study's result, with the claims checked."""
        data = {**data, "not_tested": self._words["not_tested"]}
        return StudyResult(self._name, self._words["title"], data, tuple(self.claims))


def track(progress: Progress, items: Sequence[Item]) -> Iterator[Item]:
    """Yield items, and report how many of them are done."""
    for done, item in enumerate(items):
        progress(done, len(items))
        yield item
    progress(len(items), len(items))


def part(progress: Progress, start: int, end: int, total: int) -> Progress:
    """Return a callback for a part of the work: ``start`` to ``end`` of ``total`` steps."""
    return lambda done, of: progress(start + (end - start) * done // of, total)
