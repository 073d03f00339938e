"""Objectives that a question may name, and what each needs of the question."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple, get_args

__all__ = [
    "MOVING_WRIST_OBJECTIVES",
    "OBJECTIVE_NEEDS",
    "Objective",
    "ObjectiveNeeds",
    "objective_needs",
]

Objective = Literal["max_margin", "min_effort", "max_reliability", "max_robust"]


class ObjectiveNeeds(NamedTuple):
    """Needs of an objective: what a question must have, and may not have, for it.

    Attributes
    ----------
    fixed_wrists : bool
        Whether all hands need fixed wrists.
    scatter : bool
        Whether it needs the scatter of tiles' strengths, and takes a tolerance.
    samples : bool
        Whether it needs samples of the parameters: its plan takes as long as many plans.
    whole_cap : bool
        Whether its plan may use all of the cap on the utilisation, whatever the least is.
    """

    fixed_wrists: bool = False
    scatter: bool = False
    samples: bool = False
    whole_cap: bool = False


OBJECTIVE_NEEDS: Final[Mapping[str, ObjectiveNeeds]] = {
    "max_margin": ObjectiveNeeds(),
    "min_effort": ObjectiveNeeds(whole_cap=True),
    "max_reliability": ObjectiveNeeds(fixed_wrists=True, scatter=True),
    "max_robust": ObjectiveNeeds(fixed_wrists=True, samples=True, whole_cap=True),
}
"""Needs by the objective's name; an objective of the caller's own has none."""


def objective_needs(name: str) -> ObjectiveNeeds:
    """Return what the objective of a name needs; nothing if the name is not known."""
    return OBJECTIVE_NEEDS.get(name) or ObjectiveNeeds()


MOVING_WRIST_OBJECTIVES: Final[tuple[Objective, ...]] = tuple(
    name for name in get_args(Objective) if not OBJECTIVE_NEEDS[name].fixed_wrists
)
"""Those that a question with compliant or floating wrists may name."""
