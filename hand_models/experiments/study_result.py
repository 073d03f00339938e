"""Result of a study: its data, and the paper's claims beside the model's values."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, Literal, TypeAlias, TypeVar

from hand_models.base import Progress

__all__ = ["Claim", "Role", "StudyResult", "StudyText", "listed", "part", "track"]

Item = TypeVar("Item")

Role: TypeAlias = Literal["test", "calibration"]
"""'test' for a claim that tests the model; 'calibration' if a parameter was fitted to the claim."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, with the paper's value and the model's.

    Attributes
    ----------
    claim : str
        Text of the claim in the paper's words, or close to them, with its place in the paper.
    claimed, got : str or float
        The paper's value and the model's.
    holds : bool
        True if the model confirms the claim.
    role : {'test', 'calibration'}
        'calibration' if a parameter was fitted to the claim, so that the claim proves nothing.
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
        Name, such as ``fig06``, and subject of the study.
    data : dict
        The figure's data in SI units: JSON values, and arrays. ``not_tested``, if there, lists in
        words the statements of the paper that nothing published can decide; ``summary`` lists
        further remarks for a reader.
    claims : tuple of Claim
    hand : dict
        Entries of the hand that differ from the bundled hand, by section and name; filled in by
        `run_study`.
    """

    name: str
    title: str
    data: dict[str, Any]
    claims: tuple[Claim, ...]
    hand: dict[str, dict[str, Any]] = field(default_factory=dict)


class StudyText:
    """The texts of a study from ``studies.toml``, and the claims that were checked.

    Parameters
    ----------
    study : str
        Name of the study's table in the file.

    Attributes
    ----------
    claims : list of Claim
        Claims checked so far.
    """

    def __init__(self, study: str) -> None:
        text = resources.files(__package__).joinpath("studies.toml").read_text("utf-8")
        self._name, self._words = study, tomllib.loads(text)[study]
        self.claims: list[Claim] = []

    def check(self, name: str, holds: object, **values: Any) -> None:
        """Add a checked claim, with its texts from ``studies.toml``.

        Parameters
        ----------
        name : str
            Name of the claim in the file.
        holds : bool
            True if the model confirms the claim.
        **values
            Values of the placeholders in the texts. ``got``, ``claimed`` and ``role`` take the
            place of the file's; the role is ``test`` by default.
        """
        words = {**self._words["claims"][name], "holds": bool(holds)}
        own = {key: values[key] for key in ("got", "claimed", "role") if key in values}
        self.claims.append(Claim(**_filled(words | own, values)))

    def label(self, axes: Any, name: str, **values: Any) -> None:
        """Set the title, labels and ranges of axes from ``studies.toml``, and draw their legend.

        Parameters
        ----------
        axes : Axes
        name : str
            Name of the axes in the file.
        **values
            Values of the placeholders in the texts.
        """
        words = _filled(self._words["axes"][name], values)
        legend = words.pop("legend", None)
        axes.set(**words)
        if legend is not None:
            axes.legend(**_filled(legend, values))

    def result(self, data: dict[str, Any]) -> StudyResult:
        """Return the study's result: data, title from ``studies.toml``, and the claims checked.

        Parameters
        ----------
        data : dict
            Data of the study; ``not_tested`` is added from ``studies.toml``.
        """
        data = {**data, "not_tested": self._words["not_tested"]}
        return StudyResult(self._name, self._words["title"], data, tuple(self.claims))


def _filled(words: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Return words with their placeholders filled in; numbers are as they are."""
    return {k: w.format(**values) if isinstance(w, str) else w for k, w in words.items()}


def listed(names: Iterable[object], values: Iterable[object], form: str = ".2f") -> str:
    """Return values by their names in words, such as ``proximal 0.41, distal 0.20``.

    Parameters
    ----------
    names, values : iterable
        As many of one as of the other.
    form : str
        Format of a value, and what may follow it: ``.1f``.
    """
    pairs = zip(names, values, strict=True)
    return ", ".join(f"{name} {value:{form}}" for name, value in pairs)


def track(progress: Progress, items: Sequence[Item]) -> Iterator[Item]:
    """Yield the items of a sequence, and report progress before each item and at the end.

    Parameters
    ----------
    progress : Progress
        Called with (items done, items in all).
    items : sequence
    """
    for done, item in enumerate(items):
        progress(done, len(items))
        yield item
    progress(len(items), len(items))


def part(progress: Progress, start: int, end: int, total: int) -> Progress:
    """Return a progress callback for one part of a longer work.

    Parameters
    ----------
    progress : Progress
        Callback of the whole work, called with (steps done, ``total``).
    start, end, total : int
        Steps of the whole work at which the part begins and ends, and their number in all.

    Returns
    -------
    Progress
        Called with (steps done, steps in all) of the part; calls ``progress`` in proportion.
    """
    return lambda done, of: progress(start + (end - start) * done // of, total)
