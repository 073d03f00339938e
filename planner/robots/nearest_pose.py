"""How near a limb comes to a pose that none of its angles solve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from hand_models.base import Array, Pose
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.pose_search import starts_near

__all__ = ["PLACED", "angles_near", "lacking"]

STARTS: Final = 2
"""Postures from which a pose out of reach is approached, beside the best found."""

FIRST: Final = 300.0
"""How much heavier what comes first counts than what comes second."""

STEPS: Final = 40
"""Most steps from a start."""

PLACED: Final = 1e-3
"""Distance up to which a hand counts as in its place [m]."""

TURNED: Final = 2e-3
"""Angle up to which it counts as turned as asked [rad]."""

HALVINGS: Final = 12
"""How often the range is halved in which the weight is, as a power of `FIRST`, at which a part is
just within its tolerance."""


class _Approach(NamedTuple):
    """Where a limb comes nearest to a pose by some measure.

    Attributes
    ----------
    angles : ndarray, shape (n,)
        [rad]
    way : float
        Distance of the hand from its place [m].
    turned : float
        Angle of its axes from those asked for [rad].
    """

    angles: Array
    way: float
    turned: float


def angles_near(batch: LimbBatch, i: int, best: Array, most: tuple[float, float]) -> Array | None:
    """Return angles of limb i that put its hand nearest to its pose, within a tolerance.

    Nearest is the least (distance / tolerance)² + (angle / tolerance)², both within theirs.

    Parameters
    ----------
    batch : LimbBatch
    i : int
    best : ndarray, shape (n,)
        The angles that came nearest so far.
    most : tuple of float, float
        Distance [m] and angle [rad] up to which a pose is near.

    Returns
    -------
    ndarray, shape (n,), or None
        None if none were found.
    """
    off, askew = most
    # the end of the limb is moved by no more than this
    if batch.beyond[i] > off + askew * batch.levers[i]:
        return None
    part, starts = _starts(batch, i, best)
    found = _nearest(part, starts, 1.0 / off, 1.0 / askew)
    if found.way <= off and found.turned <= askew:
        return found.angles
    if math.hypot(found.way / off, found.turned / askew) > math.sqrt(2.0):
        return None  # what is within both is no farther than that
    return _balanced(part, found, most)


def _balanced(part: LimbBatch, found: _Approach, most: tuple[float, float]) -> Array | None:
    """Return the nearest angles with a part at its tolerance that is beyond it, if both can be.

    That part, distance or angle, counts the more, the less of it may be left.
    """
    off, askew = most
    far = found.way > off
    low, high, within = 0.0, 1.0, None
    for k in range(HALVINGS):
        deadline.check("it was known how near a hand comes to its pose")
        middle = high if k == 0 else 0.5 * (low + high)
        place, turn = (FIRST**middle, 1.0) if far else (1.0, FIRST**middle)
        tried = _nearest(part, [found.angles], place / off, turn / askew)
        if (tried.way > off) if far else (tried.turned > askew):
            low = middle
        else:
            high, within = middle, tried
    met = within is not None and within.way <= off and within.turned <= askew
    return within.angles if within is not None and met else None


def lacking(batch: LimbBatch, i: int, best: Array) -> tuple[float, float | None]:
    """Return what the pose of limb i lacks that no joint angles give.

    From several starts, the hand is put in its place and turned as far as that lets it; and it is
    turned as asked and brought as near as that lets it.

    Returns
    -------
    missing : float
        How far away the hand stays, turned as asked if it can be, and not less than the pose is
        beyond the stretched limb [m].
    turned : float or None
        Where the place is within reach, but not with these axes: the angle that is missing there
        [rad].
    """
    part, starts = _starts(batch, i, best)
    placed = _nearest(part, starts, FIRST, 1.0)
    turned = _nearest(part, starts, 1.0, FIRST)
    # without a posture that is turned as asked, what is told is how far away the place is
    missing = turned.way if turned.turned <= TURNED else placed.way
    beyond = float(batch.beyond[i])
    if beyond > 0.0 and missing <= beyond + PLACED:
        missing = beyond
    return missing, placed.turned if placed.way <= PLACED else None


def _starts(batch: LimbBatch, i: int, best: Array) -> tuple[LimbBatch, list[Array]]:
    """Return a limb by itself, and angles from which its pose is approached."""
    near = starts_near(batch, i, 0)[:STARTS, : batch.joints[i]]
    return batch.part(np.array([i])), [best, *near]


def _nearest(limb: LimbBatch, starts: Sequence[Array], place: float, turn: float) -> _Approach:
    """Return where the weighed sum of a hand's squared distance [m] and angle [rad] is least."""
    (pose,), (reach,) = limb.poses.values(), limb.reach.tolist()

    def weighed(angles: Array) -> Array:
        way, turned = limb.errors(angles[None, None])[0].reshape(2, 3)
        return np.concatenate([place * reach * _axes(pose, turned) @ way, turn * turned])

    def slope(angles: Array) -> Array:
        errors, jacobians = limb.errors(angles[None, None])
        turned, (linear, angular) = errors[0, 0, 3:], np.split(jacobians[0, 0], 2)
        # Jₗ⁻¹(r), which is Jᵣ⁻¹(r)ᵀ, is how a rotation vector r changes with a rotation before it
        turning = pin.Jlog3(pin.exp3(turned)).T
        return -np.vstack([place * reach * _axes(pose, turned) @ linear, turn * turning @ angular])

    low, high = limb.lower[0], limb.upper[0]
    ends = [
        least_squares(weighed, np.clip(start, low, high), slope, bounds=(low, high), max_nfev=STEPS)
        for start in starts
    ]
    angles = min(ends, key=lambda end: float(end.cost)).x
    way, turned = np.linalg.norm(weighed(angles).reshape(2, 3), axis=1)
    return _Approach(angles, float(way) / place, float(turned) / turn)


def _axes(pose: Pose, turned: Array) -> Array:
    """Return a hand's axes in B, shape (3, 3), that lack a turn (3,) in H to those of a pose."""
    return np.asarray(pose.rotation @ pin.exp3(-turned))
