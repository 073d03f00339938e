"""How much of the least utilisation a plan gives away for less tension, and at what price.

Least utilisation alone pulls a tendon to its strength for a ten-thousandth of it. So a plan is
meant that minimises

    u + w Σ (tension / maximum)²   with   u ≤ u* + r,   r = min(`given_away` u*, cap − u*) ≥ 0,

u* being the least utilisation: near the cap, and beyond, nothing is given away. The plan is unique,
and changes continuously with u* and the rows, as the objective is strictly convex and r continuous.
Where no tendon pulls for next to nothing it is the plan of least utilisation itself, of these the
one of least Σ (tension / maximum)². No plan within u* + r has a sum that is less by more than r/w.
"""

from __future__ import annotations

from importlib import resources
from typing import Final, NamedTuple

from hand_models.parameters import ParameterTable

__all__ = ["TensionTrade", "tension_trade"]

_PLANS = resources.files("planner.parameters").joinpath("plans.toml")
_TABLE = ParameterTable.read(_PLANS.read_text("utf-8"), _PLANS.name)

GIVEN_AWAY: Final = _TABLE.positive("tension", "given_away")
"""Part of the least utilisation that a plan gives away at most."""

WEIGHT: Final = _TABLE.positive("tension", "weight")
"""w"""


class TensionTrade(NamedTuple):
    """What a plan may give away.

    Attributes
    ----------
    weight : float
        w of the sum of squared relative tensions.
    most : float
        Largest utilisation of the plan.
    whole : float
        What is given away at most, far from the cap.
    """

    weight: float
    most: float
    whole: float = 0.0


def tension_trade(least: float, cap: float) -> TensionTrade:
    """Return what a plan may give away.

    Parameters
    ----------
    least : float
        The least utilisation.
    cap : float
        On the utilisation, that the question asks for.
    """
    whole = GIVEN_AWAY * abs(least)
    return TensionTrade(WEIGHT, least + max(min(whole, cap - least), 0.0), whole)
