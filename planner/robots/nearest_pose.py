"""Bring a limb as near as possible to a pose that none of its angles solve.

The least sum of squares, which does not vanish there, has many minima, and is flat where a
limb is stretched: so it is sought from many postures, and with curvatures (sequential quadratic
programming) instead of the slopes alone.
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
    """Return limb i by itself, and angles (n,) from which its pose is approached.

    Parameters
    ----------
    batch : LimbBatch
    i : int
    best : ndarray, shape (n,)
        The angles that came nearest so far; the first of those returned.
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
    """Return angles of a limb that put its hand nearest to its pose, within a tolerance.

    Nearest is the least (distance / tolerance)² + (angle / tolerance)², both within theirs.

    Parameters
    ----------
    limb : LimbBatch
        One alone.
    starts : sequence of ndarray, shape (n,)
        Where to begin, as `starts_beside` finds them.
    most : tuple of float, float
        Distance [m] and angle [rad] up to which a pose is near.

    Returns
    -------
    ndarray, shape (n,), or None
        None if none were found.
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
    """Return what a limb's pose lacks that no joint angles give.

    From the first starts, the hand is put in its place and turned as far as that lets it; and it is
    turned as asked and brought as near as that lets it.

    Parameters
    ----------
    limb : LimbBatch
        One alone.
    starts : sequence of ndarray, shape (n,)
        Where to begin, as `starts_beside` finds them.

    Returns
    -------
    missing : float
        How far away the hand stays, turned as asked if it can be, and not less than the pose is
        beyond the stretched limb [m].
    turned : float or None
        Where the place is within reach, but not with these axes: the angle that is missing there
        [rad].
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
