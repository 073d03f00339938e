"""What a study finds: data, and claims of the paper beside what the model gives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias, TypeVar

from hand_models.base import Progress

__all__ = ["Claim", "Role", "StudyResult", "part", "track"]

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
    """What a study found.

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


def track(progress: Progress, items: Sequence[Item]) -> Iterator[Item]:
    """Yield items, and tell how many of them are done."""
    for done, item in enumerate(items):
        progress(done, len(items))
        yield item
    progress(len(items), len(items))


def part(progress: Progress, start: int, end: int, total: int) -> Progress:
    """Return what tells the progress of a part of the work, from ``start`` to ``end`` of all."""
    return lambda done, of: progress(start + (end - start) * done // of, total)
