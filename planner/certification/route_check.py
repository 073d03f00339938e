"""Check of the route in a certificate: every state is held, and each is one move from the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices
from planner.certification.climb_certificate import ClimbCertificate
from planner.certification.settings import CERTIFICATION_SETTINGS

__all__ = ["RouteCheck", "check_route"]


class RouteCheck(NamedTuple):
    """The answer of the check of a route.

    Attributes
    ----------
    factors : ndarray, shape (S,)
        Load factor of each state, by a linear program of its own; −∞ where none was found.
    fault : str or None
        The first thing that is wrong with the route.
    """

    factors: Array
    fault: str | None

    @property
    def least(self) -> float:
        """Least load factor of all states; −∞ without a route, or with a fault."""
        return float(self.factors.min()) if self.fault is None and len(self.factors) else -np.inf


def check_route(certificate: ClimbCertificate) -> RouteCheck:
    """Recompute the load factors of a certificate's route, and whether its states are connected.

    Parameters
    ----------
    certificate : ClimbCertificate
    """
    c = certificate
    states = list(zip(c.route_bodies.tolist(), c.route_members, strict=True))
    factors = np.array([_load_factor(c, body, members) for body, members in states])
    fault = None if len(states) == 0 else _fault(c, factors)
    return RouteCheck(factors, fault)


def _fault(c: ClimbCertificate, factors: Array) -> str | None:
    bodies, members = c.route_bodies, c.route_members
    ends = (
        (0, "start", c.start_bodies, c.start_members),
        (-1, "goal", c.goal_bodies, c.goal_members),
    )
    for i, name, at, wanted in ends:
        if not at[bodies[i]] or not ((wanted < 0) | (members[i] == wanted)).all():
            return f"state {i % len(bodies)} is not at the {name}"
    tolerance = CERTIFICATION_SETTINGS.factor_error
    for i, (body, row) in enumerate(zip(bodies.tolist(), members, strict=True)):
        on = np.flatnonzero(row >= 0)
        if len(on) < len(row) - 1:
            return f"state {i} has more than one limb in the air"
        if not c.reached[row[on], body, on].all():
            return f"state {i} has a placement that its limb does not reach"
        pairs = c.apart[np.ix_(row[on], row[on])] | np.eye(len(on), dtype=bool)
        if not pairs.all():
            return f"state {i} has two hands that are too near each other"
        if factors[i] < c.route_factors[i] - tolerance * (1.0 + abs(c.route_factors[i])):
            return f"state {i} has a load factor of {factors[i]:.6g}, not {c.route_factors[i]:.6g}"
        if i and not _one_move(c, i):
            return f"state {i} is not one move from the state before"
    return None


def _one_move(c: ClimbCertificate, i: int) -> bool:
    """Return whether a state differs from the one before by one limb in the air, or by a shift."""
    (before, after), bodies = c.route_members[i - 1 : i + 1], c.route_bodies[i - 1 : i + 1]
    changed = before != after
    if bodies[0] == bodies[1]:
        return bool(changed.sum() == 1 and min(before[changed][0], after[changed][0]) < 0)
    shifted = (c.shifts == bodies).all(axis=1) | (c.shifts == bodies[::-1]).all(axis=1)
    return bool(shifted.any() and not changed.any() and (after >= 0).all())


def _load_factor(c: ClimbCertificate, body: int, members: Indices) -> float:
    """Return the largest multiple of a state's body wrench that its hands hold; −∞ for none."""
    on = np.flatnonzero(members >= 0)
    hands = members[on].tolist()
    wrench = c.wrenches[body].copy()
    wrench[3:] += c.moments[body, on, hands].sum(axis=0)
    of = [slice(c.parts[c.hands[p]], c.parts[c.hands[p + 1]]) for p in hands]
    lengths = [np.diff(c.parts[c.hands[p] : c.hands[p + 1] + 1]) for p in hands]
    points = np.vstack([c.points[own] for own in of])
    parts = np.concatenate(lengths)
    sums = np.repeat(np.eye(len(parts)), parts, axis=1)
    rows = scipy.linalg.block_diag(*(c.rows[own] for own in of)).T.reshape(-1, len(points))
    room, base = c.room[hands].ravel(), c.base[hands].sum(axis=0)
    finite = np.isfinite(room)
    balance = np.column_stack([-wrench, points.T])
    solved = scipy.optimize.linprog(
        np.append(-1.0, np.zeros(len(points))),
        np.column_stack([np.zeros(finite.sum()), rows[finite]]),
        room[finite],
        np.vstack([balance, np.column_stack([np.zeros(len(parts)), sums])]),
        np.append(-base, np.ones(len(parts))),
    )
    if solved.status != 0 or solved.x is None:
        return -np.inf
    residual = np.abs(balance @ solved.x + base).max()
    weights = np.abs(sums @ solved.x[1:] - 1.0).max()
    excess = (rows[finite] @ solved.x[1:] - room[finite]).max(initial=0.0)
    fits = max(residual, weights, excess) <= CERTIFICATION_SETTINGS.balance_error
    return float(solved.x[0]) if fits else -np.inf
