"""One function for each conic program of a stance, and evaluations of given loads.

The programs are defined in `planner.programs.program`. Loads y are in newtons; those of a floating
wrist are its twist [m, rad], those of a compliant wrist its tensions [N], then its twist. ``data``
holds the scaled rows of all hands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.parameters import bundled_table
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
"""Utilisation by which the tie-break may exceed the least; also the tolerance at a cap."""

_PLAN_NUMBERS: Final = bundled_table("plans.toml", "planner.parameters")

GIVEN_AWAY: Final = _PLAN_NUMBERS.positive("tension", "given_away")
"""Part of the least utilisation that a plan may spend for less tension."""

TENSION_WEIGHT: Final = _PLAN_NUMBERS.positive("tension", "weight")
"""Weight w of the sum of squared relative tensions."""


class TensionTrade(NamedTuple):
    """Utilisation above the least, u*, that a plan may spend in exchange for less tendon tension.

    The plan of least utilisation alone would pull a tendon to its strength to gain a ten-thousandth
    of utilisation. So the planner returns the plan that minimises

        u + w Σ (tension / maximum)²   with   u ≤ u* + r,   r = min(`given_away` u*, cap − u*) ≥ 0.

    At the cap and beyond, r is zero: the plan is that of least utilisation and, among those, of
    least Σ (tension / maximum)². The plan is unique, as the objective is strictly convex; it
    changes continuously with u* and the rows, as r is continuous. No plan within u* + r has a sum
    that is less by more than r/w.

    Attributes
    ----------
    weight : float
        Weight w of the sum of squared relative tensions.
    most : float
        Largest utilisation of the plan, u* + r.
    whole : float
        Value of r before the cap shortens it: `given_away` u*, a part of u* from ``plans.toml``.
    """

    weight: float
    most: float
    whole: float = 0.0


def tension_trade(least: float, cap: float) -> TensionTrade:
    """Return how much utilisation a plan may spend for less tendon tension.

    Parameters
    ----------
    least : float
        Least utilisation u* of the question.
    cap : float
        Largest utilisation that the question allows.

    Returns
    -------
    TensionTrade
        Weight of the tensions, and bounds of the utilisation.
    """
    whole = GIVEN_AWAY * abs(least)
    return TensionTrade(TENSION_WEIGHT, least + max(min(whole, cap - least), 0.0), whole)


def margin(data: StanceData) -> Outcome:
    """Solve for the least utilisation (largest load over capacity) at which the body is balanced.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.

    Returns
    -------
    Outcome
        ``value`` is the least utilisation; the dual values of the limits give their shadow prices.
    """
    return Best(data).solve()


def vertex(data: StanceData) -> Outcome:
    """Solve for the least utilisation by the simplex method; see `Best.vertex`."""
    return Best(data).vertex()


def unique(data: StanceData, share: float = 1.0) -> Outcome:
    """Solve for the least utilisation, made unique by a small weight on tensions, in one solve.

    A tension is at most u times its maximum, so the returned utilisation u exceeds the least by
    less than TIE_WEIGHT u².

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    share : float, optional
        Factor on the weight of the tensions.

    Returns
    -------
    Outcome
        ``value`` is the utilisation u, without the weighted tensions.
    """
    return Best(data, weights=tie_weight(len(data.hands)) * share * data.rows.tie).solve()


def less_tension(data: StanceData, trade: TensionTrade) -> Outcome:
    """Solve for the plan that trades utilisation for less tendon tension; see `TensionTrade`.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    trade : TensionTrade
        Weight of the tensions, and largest utilisation of the plan.

    Returns
    -------
    Outcome
        ``value`` is the utilisation of the plan.
    """
    return Best(data, weights=trade.weight * data.rows.tie, most=trade.most).solve()


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve for the least utilisation plus a quadratic term ½ ‖R (z − z₀)‖² around given loads.

    The term stands for the curvature of floating hands' rows, and keeps the solution near z₀.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    root : ndarray, shape (M, M)
        Root R of the curvature RᵀR in the scaled loads z of all hands.
    near : sequence of ndarray, shape (m,)
        Loads y₀ of each hand [N], or twist of a wrist that moves [m, rad]; z₀ = y₀ / units.
    """
    centre = root @ (np.concatenate(near) / data.rows.unit)
    return Best(data, residuals=Residuals(root, centre, 0.5)).solve()


def tie_break(data: StanceData, cap: float) -> Outcome:
    """Solve for the least sum of squared relative tensions under a cap on the utilisation.

    It selects one of the plans that have equal utilisation.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    cap : float
        Largest utilisation.
    """
    # weights relative to the largest: the minimiser does not change
    return Best(data, cap=cap, weights=data.rows.tie / data.rows.tie.max()).solve()


def least_tensions(data: StanceData, utilisation: float) -> Outcome:
    """Solve `tie_break` at a given utilisation; retry with more slack if the first solve fails.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    utilisation : float
        Least utilisation. The cap is larger by 1e-9 (absolute below 1, relative above), in the
        second try by `CAP_SLACK`.

    Returns
    -------
    Outcome
        Outcome of the last try; status `OUT_OF_TIME` or unsolved if both fail.
    """
    outcome = Outcome(False, OUT_OF_TIME, 0, math.nan)
    for slack in (1e-9, CAP_SLACK):  # where the least has all its digits, or else near it
        outcome = tie_break(data, utilisation + slack * max(1.0, abs(utilisation)))
        if outcome.solved or deadline.expired():
            break
    return outcome


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve for the least effort: the sum of squared relative tensions and joint torques.

    Small weights make the other loads unique (palms, lateral reactions, wrists).

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    cap : float
        Largest utilisation.
    """
    E = scipy.linalg.block_diag(*(hand.E for hand in data.hands))
    e0 = np.concatenate([hand.e0 for hand in data.hands])
    rest = np.concatenate([hand.rest for hand in data.hands])
    return Best(data, cap=cap, weights=rest, residuals=Residuals(E, -e0, 1.0)).solve()


def elastic(
    data: StanceData,
    penalty: float,
    near: Sequence[Array],
    firm: NDArray[np.bool_],
    nearness: float = 1e-3,
) -> Outcome:
    """Solve the relaxed program `Elastic` around given loads.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    penalty : float
        Price ρ of violations of the balance and of hard rows.
    near : sequence of ndarray, shape (m,)
        Loads y of each hand near which the solution is kept [N]; twists of wrists [m, rad].
    firm : ndarray of bool, shape (Σ nh,)
        True for each hard row that must not be exceeded.
    nearness : float, optional
        Weight of half the squared distance from these loads, in the units of z.

    Returns
    -------
    Outcome
        ``value`` is the utilisation plus ρ times all violations.
    """
    return Elastic(data, penalty, np.concatenate(near) / data.rows.unit, firm, nearness).solve()


def load_factor(data: StanceData) -> Outcome:
    """Solve for the load factor: largest multiple of a body wrench, not 0, at utilisation 1.

    ``value`` of the outcome is the load factor.
    """
    return Reach.load_factor(data).solve()


def reach(
    data: StanceData, goal: Array, B: Array, cap: float = 1.0, K: Sequence[Array] | None = None
) -> Reached:
    """Solve `Reach`: the farthest t along the columns of B, in direction ``goal``, within a cap.

    The parameters are those of `Reach`, with their shapes and units.
    """
    return Reach(data, goal, B, cap, K).farthest()


def nearest(data: StanceData) -> Outcome:
    """Solve for loads whose body wrench is nearest to the one asked for; limits do not count.

    Prescribed components of hand wrenches count like the body wrench. ``value`` of the outcome is
    the distance, in `WRENCH_UNIT`. See `Nearest`.
    """
    return Nearest(data).solve()


def nearest_body(data: StanceData) -> Outcome:
    """Solve `nearest` with all prescribed components of hand wrenches met exactly."""
    return Nearest(data, len(data.wrench) - 6).solve()


def loads_are_feasible(data: StanceData, loads: Sequence[Array], cap: float) -> bool:
    """Return whether loads balance the body, and meet hard rows and limits at a cap.

    The tolerance is `CAP_SLACK`.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand [N]; for wrists that move, also or only the twist [m, rad].
    cap : float
        Largest utilisation.
    """
    error = np.abs(body_wrench(data, loads) - data.wrench).max()
    balances = bool(error <= CAP_SLACK * max(1.0, float(np.abs(data.wrench).max())))
    return balances and beyond(data, loads, cap) <= CAP_SLACK


def body_wrench(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the left-hand side of the balance for given loads of all hands.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand [N]; for wrists that move, also or only the twist [m, rad].

    Returns
    -------
    ndarray, shape (nb,)
        Body wrench, then prescribed components of hands' wrenches, in `WRENCH_UNIT`.
    """
    parts = [hand.G @ (y / hand.unit) + hand.g for hand, y in zip(data.hands, loads, strict=True)]
    return np.asarray(sum(parts, start=np.zeros_like(data.wrench)))


def beyond(data: StanceData, loads: Sequence[Array], cap: float) -> float:
    """Return the largest excess of given loads over limits at a cap, or over hard rows.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand [N]; for wrists that move, also or only the twist [m, rad].
    cap : float
        Largest utilisation.

    Returns
    -------
    float
        Utilisation minus cap of a limit, or excess of a hard row [`LOAD_UNIT`]; at least 0.
    """
    worst = 0.0
    for hand, y in zip(data.hands, loads, strict=True):
        z = y / hand.unit
        worst = max(worst, float((hand.L @ z + hand.l0 - cap).max(initial=0.0)))
        worst = max(worst, float((hand.H @ z - hand.h).max(initial=0.0)))
    return worst


def used(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the utilisation (load over capacity) of every limit row at given loads.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    loads : sequence of ndarray, shape (m,)
        Loads y of each hand [N]; for wrists that move, also or only the twist [m, rad].

    Returns
    -------
    ndarray, shape (Σ nl,)
        Utilisations, hand by hand.
    """
    parts = zip(data.hands, loads, strict=True)
    return np.concatenate([hand.L @ (y / hand.unit) + hand.l0 for hand, y in parts])


def used_effort(data: StanceData, loads: Sequence[Array]) -> float:
    """Return the effort of loads y: Σ ‖E z + e₀‖², squared relative tensions and torques.

    z are the loads over their units.
    """
    return sum(
        float(np.sum((hand.E @ (y / hand.unit) + hand.e0) ** 2))
        for hand, y in zip(data.hands, loads, strict=True)
    )
