"""What a deadline has left unfinished of an answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

from planner.deadline.clock import expired

__all__ = ["Unfinished", "late", "late_sentence"]

Unfinished = Literal[
    "least_utilisation",
    "tie_break",
    "wrists",
    "least_effort",
    "load_factor",
    "path",
    "certificate",
    "explanation",
    "robust",
]

UNFINISHED: Final[dict[Unfinished, str]] = {
    "least_utilisation": "it was proven that no plan uses less",
    "tie_break": "the one of least effort was found of the plans that use as little",
    "wrists": "the search for the poses of the floating wrists ended",
    "least_effort": "the plan of least effort was found",
    "load_factor": "the load factor was found",
    "path": "it was found whether the way from the present tensions is safe",
    "certificate": "it was found what keeps the hands from a plan within the limits",
    "explanation": "it was found which limits alone leave no balance",
    "robust": "the load factor was found at all places of the hands",
}
"""What was not there yet."""


def late(name: Unfinished) -> tuple[Unfinished, ...]:
    """Return the name of what is not finished, if that is for the time."""
    return (name,) if expired() else ()


def late_sentence(seconds: float, names: Sequence[Unfinished]) -> str:
    """Say what came too late for a deadline [s], and what the answer is therefore."""
    missing = ", before ".join(UNFINISHED[name] for name in names)
    sentence = f"the deadline of {seconds:g} s came before {missing}"
    if "least_effort" in names:
        sentence += "; the plan is one of less utilisation and more effort"
    return sentence
