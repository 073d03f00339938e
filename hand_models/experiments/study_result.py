"""What a study finds: data, and claims of the paper beside what the model gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from hand_models.base import whole_file

__all__ = ["Claim", "StudyResult", "save_picture"]


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
    role: Literal["test", "calibration"] = "test"


@dataclass(frozen=True)
class StudyResult:
    """What a study found.

    Attributes
    ----------
    name, title : str
        Its name, such as ``fig06``, and what it is about.
    data : dict
        The figure's data, as JSON can write it, SI units. ``not_tested``, if there, lists in words
        what the paper says and nothing published can decide; ``summary`` what else a person
        should read.
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


def save_picture(figure: Figure, path: Path) -> Path:
    """Write a figure of a study as PNG."""
    with whole_file(path) as part:
        figure.savefig(part, dpi=130, bbox_inches="tight", facecolor="white")
    return path
