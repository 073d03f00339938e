"""The programs, solved, and what loads do to their rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.parameters import ParameterTable
from planner import deadline
from planner.programs.conic import OUT_OF_TIME, Outcome, Reached
from planner.programs.program import Best, Elastic, Nearest, Reach, Residuals, tie_weight
from planner.programs.stance_data import StanceData

__all__ = [
    "CAP_SLACK",
    "TensionTrade",
    "beyond",
    "body_wrench",
    "curved",
    "effort",
    "elastic",
    "least_tensions",
    "less_tension",
    "load_factor",
    "loads_are_feasible",
    "margin",
    "nearest",
    "nearest_body",
    "reach",
    "tension_trade",
    "tie_break",
    "unique",
    "used",
    "used_effort",
    "vertex",
]

CAP_SLACK: Final = 1e-6
"""Utilisation that the tie-break may give away above the least; also its tolerance at a cap."""


class TensionTrade(NamedTuple):
    """Utilisation above the least, u*, that a plan may give away for less tension.

    Least utilisation alone pulls a tendon to its strength for a ten-thousandth of it. So a plan is
    meant that minimises

        u + w Σ (tension / maximum)²   with   u ≤ u* + r,   r = min(`given_away` u*, cap − u*) ≥ 0:

    near the cap, and beyond, nothing is given away. The plan is unique, and changes continuously
    with u* and the rows, as the objective is strictly convex and r continuous. Where no tendon
    pulls for next to nothing it is the plan of least utilisation itself, of these the one of least
    Σ (tension / maximum)². No plan within u* + r has a sum that is less by more than r/w.

    Attributes
    ----------
    weight : float
        w of the sum of squared relative tensions.
    most : float
        Largest utilisation of the plan.
    whole : float
        Largest utilisation that is given away, far from the cap.
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
    given_away, weight = _tension_numbers()
    whole = given_away * abs(least)
    return TensionTrade(weight, least + max(min(whole, cap - least), 0.0), whole)


@cache
def _tension_numbers() -> tuple[float, float]:
    """Return the part of the least utilisation that is given away at most, and w."""
    path = resources.files("planner.parameters").joinpath("plans.toml")
    table = ParameterTable.read(path.read_text("utf-8"), path.name)
    return table.positive("tension", "given_away"), table.positive("tension", "weight")


def margin(data: StanceData) -> Outcome:
    """Solve for the least utilisation; ``value`` is that utilisation."""
    return Best(data).solve()


def vertex(data: StanceData) -> Outcome:
    """Solve `margin` by the simplex method."""
    return Best(data).vertex()


def unique(data: StanceData, share: float = 1.0) -> Outcome:
    """Solve for the least utilisation, made unique in one solve; ``value`` is that utilisation.

    A tension is at most u times its maximum, so the least u is exceeded by less than TIE_WEIGHT u².
    ``share``: how much of its weight the second term is given.
    """
    return Best(data, weights=tie_weight(len(data.hands)) * share * data.rows.tie).solve()


def less_tension(data: StanceData, trade: TensionTrade) -> Outcome:
    """Solve for the plan that is meant, u at most ``trade.most``; ``value`` is its utilisation."""
    return Best(data, weights=trade.weight * data.rows.tie, most=trade.most).solve()


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve for the least utilisation where sets are curved, or near to loads.

    Parameters
    ----------
    data : StanceData
    root : ndarray, shape (M, M)
        R, a root of the curvature in all hands' z.
    near : sequence of ndarray
        Each hand's y₀.
    """
    centre = root @ (np.concatenate(near) / data.rows.unit)
    return Best(data, residuals=Residuals(root, centre, 0.5)).solve()


def tie_break(data: StanceData, cap: float) -> Outcome:
    """Solve for the least tensions under a cap: which plan is meant of those."""
    # weights relative to the largest: the minimiser does not change
    return Best(data, cap=cap, weights=data.rows.tie / data.rows.tie.max()).solve()


def least_tensions(data: StanceData, utilisation: float) -> Outcome:
    """Solve `tie_break` at a utilisation that has all its digits, or where needed near it."""
    outcome = Outcome(False, OUT_OF_TIME, 0, math.nan)
    for slack in (1e-9, CAP_SLACK):  # where the least has all its digits, or else near it
        outcome = tie_break(data, utilisation + slack * max(1.0, abs(utilisation)))
        if outcome.solved or deadline.expired():
            break
    return outcome


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve for the least sum of squared relative tensions and torques under a cap.

    Small weights make loads unique that are neither: palms, lateral reactions, wrists.
    """
    E = scipy.linalg.block_diag(*(hand.E for hand in data.hands))
    e0 = np.concatenate([hand.e0 for hand in data.hands])
    rest = np.concatenate([hand.rest for hand in data.hands])
    return Best(data, cap=cap, weights=rest, residuals=Residuals(E, -e0, 1.0)).solve()


def elastic(
    data: StanceData, penalty: float, near: Sequence[Array], firm: NDArray[np.bool_]
) -> Outcome:
    """Solve `Elastic` about loads; ``value`` is the utilisation and what is wrong at its price."""
    return Elastic(data, penalty, np.concatenate(near) / data.rows.unit, firm).solve()


def load_factor(data: StanceData) -> Outcome:
    """Solve for how many times the body wrench, not zero, could be held at utilisation 1."""
    return Reach.load_factor(data).solve()


def reach(
    data: StanceData, goal: Array, B: Array, cap: float = 1.0, K: Sequence[Array] | None = None
) -> Reached:
    """Solve `Reach`."""
    return Reach(data, goal, B, cap, K).farthest()


def nearest(data: StanceData) -> Outcome:
    """Solve `Nearest`."""
    return Nearest(data).solve()


def nearest_body(data: StanceData) -> Outcome:
    """Solve `Nearest` with all given wrenches of hands kept."""
    return Nearest(data, len(data.wrench) - 6).solve()


def loads_are_feasible(data: StanceData, loads: Sequence[Array], cap: float) -> bool:
    """Return whether loads y balance, and keep hard rows and limits at a cap, by `CAP_SLACK`."""
    error = np.abs(body_wrench(data, loads) - data.wrench).max()
    balances = bool(error <= CAP_SLACK * max(1.0, float(np.abs(data.wrench).max())))
    return balances and beyond(data, loads, cap) <= CAP_SLACK


def body_wrench(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the scaled balance that the hands' loads y give, shape (nb,)."""
    parts = [hand.G @ (y / hand.unit) + hand.g for hand, y in zip(data.hands, loads, strict=True)]
    return np.asarray(sum(parts, start=np.zeros_like(data.wrench)))


def beyond(data: StanceData, loads: Sequence[Array], cap: float) -> float:
    """Return by how much loads y exceed limits at a cap, or break hard rows, scaled; at least 0."""
    worst = 0.0
    for hand, y in zip(data.hands, loads, strict=True):
        z = y / hand.unit
        worst = max(worst, float((hand.L @ z + hand.l0 - cap).max(initial=0.0)))
        worst = max(worst, float((hand.H @ z - hand.h).max(initial=0.0)))
    return worst


def used(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the utilisation of every limit row, hand by hand, shape (sum of nl,)."""
    parts = zip(data.hands, loads, strict=True)
    return np.concatenate([hand.L @ (y / hand.unit) + hand.l0 for hand, y in parts])


def used_effort(data: StanceData, loads: Sequence[Array]) -> float:
    """Return Σ ‖E z + e₀‖²: the sum of squared relative tensions and joint torques."""
    return sum(
        float(np.sum((hand.E @ (y / hand.unit) + hand.e0) ** 2))
        for hand, y in zip(data.hands, loads, strict=True)
    )
