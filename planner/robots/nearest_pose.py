"""Bring a hand as near as possible to a pose that no joint angles of its limb solve.

The sum of the squared distance and angle to the pose is minimised by sequential quadratic
programming (SLSQP), from many postures: the sum has many local minima, and is flat where a limb is
stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.pose_search import damped_step, postures_near
from planner.robots.tolerances import TOLERANCES

__all__ = ["angles_near", "lacking", "starts_beside"]


class _Approach(NamedTuple):
    """Posture in which a limb is nearest to a pose by some measure.

    Attributes
    ----------
    angles : ndarray, shape (n,)
        Joint angles [rad].
    off : ndarray, shape (2,)
        Distance of the hand from its place [m], and angle of its axes from those asked for [rad].
    measure : float
    """

    angles: Array
    off: Array
    measure: float


def starts_beside(batch: LimbBatch, i: int, best: Array) -> tuple[LimbBatch, Sequence[Array]]:
    """Return a batch of limb i alone, and start postures for `angles_near` and `lacking`.

    Parameters
    ----------
    batch : LimbBatch
        Limbs, with target poses and loads of their hands.
    i : int
        Index of the limb in the batch.
    best : ndarray, shape (n,)
        Joint angles that came nearest to the pose so far [rad].

    Returns
    -------
    limb : LimbBatch
        The batch of limb i.
    starts : sequence of ndarray, shape (n,)
        Joint angles [rad]: ``best``, then eight more, the nearest first.
    """
    limb = batch.part(np.array([i]))
    angles = postures_near(batch, i, 128)[:, None]
    for _ in range(8):  # steps nearer to the pose
        deadline.check("the reachable pose closest to a hand's was found")
        angles = damped_step(limb, angles, *limb.errors(angles))
    errors = (limb.errors(angles)[0] ** 2).sum(axis=(1, 2))
    # the nearest are followed to the end
    return limb, [best, *angles[np.argsort(errors, kind="stable")[:8], 0]]


def angles_near(
    limb: LimbBatch, starts: Sequence[Array], most: tuple[float, float]
) -> Array | None:
    """Return joint angles that put a hand nearest to its pose, within a distance and an angle.

    The angles minimise (distance / tolerance)² + (angle / tolerance)², each with its tolerance.

    Parameters
    ----------
    limb : LimbBatch
        A batch of a single limb.
    starts : sequence of ndarray, shape (n,)
        Start postures, from `starts_beside` [rad].
    most : tuple of float, float
        Tolerances: distance [m] and angle [rad].

    Returns
    -------
    ndarray, shape (n,), or None
        Joint angles [rad]; None if no posture within both tolerances was found.
    """
    # the end of the limb is moved by no more than this
    if limb.beyond[0] > most[0] + most[1] * limb.levers[0]:
        return None
    allowed = np.array(most)
    weights = allowed**-2.0
    # what is within both is no farther than two: each counts one at its tolerance
    ends = [end for end in _ends(limb, starts, weights) if end.measure <= 2.0]
    ends = [end if np.all(end.off <= allowed) else _bounded(limb, end, allowed) for end in ends]
    within = [end for end in ends if np.all(end.off <= allowed)]
    return min(within, key=lambda end: end.measure).angles if within else None


def lacking(limb: LimbBatch, starts: Sequence[Array]) -> tuple[float, float | None]:
    """Return by how far a hand misses a pose that no joint angles solve.

    Two searches from the first four starts: one puts distance before angle, the other angle before
    distance.

    Parameters
    ----------
    limb : LimbBatch
        A batch of a single limb.
    starts : sequence of ndarray, shape (n,)
        Start postures, from `starts_beside` [rad].

    Returns
    -------
    missing : float
        Distance from the hand to its target position [m], in the target's orientation if a posture
        with that orientation was found, otherwise in any. Never less than the distance by which the
        target is beyond the limb's reach.
    turned : float or None
        Angle to the target's orientation, if the hand reaches its position [rad]; otherwise None.
    """
    first = 300.0  # weight of the quantity that is least first, over that of the second
    # what is missing is only reported: a few starts will do
    (way, turn), (near, askew) = (
        min(_ends(limb, starts[:4], weights), key=lambda end: end.measure).off.tolist()
        for weights in (np.array([first**2, 1.0]), np.array([1.0, first**2]))
    )
    # without a posture that is turned as asked, the distance of the place is returned
    missing = near if askew <= 2e-3 else way  # [rad]: it counts as turned as asked
    beyond = float(limb.beyond[0])
    if beyond > 0.0 and missing <= beyond + TOLERANCES.place_error:
        missing = beyond
    return missing, turn if way <= TOLERANCES.place_error else None


def _squares(limb: LimbBatch, angles: Array) -> tuple[Array, Array]:
    """Return the squares of a hand's distance [m] and angle [rad], and their slopes (2, n).

    A rotation vector r is left alone by how it changes with a rotation, so that slope is r · J.
    """
    errors, jacobians = limb.errors(angles[None, None])
    parts, motions = errors.reshape(2, 3), jacobians.reshape(2, 3, -1)
    units = np.array([limb.reach[0] ** 2, 1.0])
    slopes = -2.0 * units[:, None] * np.einsum("px,pxn->pn", parts, motions)
    return units * (parts * parts).sum(axis=1), slopes


def _ends(limb: LimbBatch, starts: Sequence[Array], weights: Array) -> list[_Approach]:
    """Return where the weighed sum of a hand's squared distance and angle is least, by start."""
    return [_followed(limb, start, weights) for start in starts]


def _followed(
    limb: LimbBatch,
    start: Array,
    weights: Array,
    limits: Sequence[scipy.optimize.NonlinearConstraint] = (),
) -> _Approach:
    """Return where a start leads, by the weighed sum of squares, within limits."""
    deadline.check("the reachable pose closest to a hand's was found")
    low, high = limb.lower[0], limb.upper[0]

    def measured(angles: Array) -> tuple[float, Array]:
        squares, slopes = _squares(limb, angles)
        return float(weights @ squares), weights @ slopes

    end = scipy.optimize.minimize(
        measured,
        np.clip(start, low, high),
        jac=True,
        method="SLSQP",
        bounds=scipy.optimize.Bounds(low, high),
        constraints=limits,
        options={"maxiter": 150, "ftol": 1e-10},
    )
    angles = np.clip(end.x, low, high)
    squares, _ = _squares(limb, angles)
    return _Approach(angles, np.sqrt(squares), float(weights @ squares))


def _bounded(limb: LimbBatch, end: _Approach, most: Array) -> _Approach:
    """Return where distance and angle are within their tolerances, and the measure least."""
    largest = (most * (1.0 - 1e-6)) ** 2  # room for rounding
    limits = scipy.optimize.NonlinearConstraint(
        lambda angles: _squares(limb, angles)[0] / largest,
        -np.inf,
        1.0,
        jac=lambda angles: _squares(limb, angles)[1] / largest[:, None],
    )
    return _followed(limb, end.angles, most**-2.0, [limits])
