"""A planar gripper loaded along directions of the wrench until a tile lets go (Section 5.5.2).

The pose of the wrist follows the load in small increments, each solved by Newton steps on exact
stiffnesses (Section 5.4.2). Where the hull of a wrench space fills the hollows of the set, this
finds the set's own boundary, and what fails there. Wrenches are (F_x, F_z, M_y) in the paper's
signs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, EmptySetError, Progress
from hand_models.compliance import SIDES, STEP, Gripper, Numbers, WristSearch, search
from hand_models.experiments.study_result import part
from hand_models.experiments.wrench_hull import (
    UNITS,
    clipped_vertices,
    in_paper_signs,
    with_mirrored,
)
from hand_models.finger import PHALANGES

__all__ = [
    "DRAGGED",
    "UNBALANCED",
    "Pulled",
    "even_pulls",
    "explored",
    "held_wrenches",
    "pull",
    "pulled_off_poses",
    "unloaded",
    "wrist_poses",
]

DRAGGED: Final = "dragged_backwards"
UNBALANCED: Final = "no_pose"
"""How a load ends, where not at a tile's limit: a tile has less drag than it needs (`Surface`), or
nothing balances."""

PER_AXIS: Final = 60
"""Poses of the wrist along each axis of the studies' searches."""

NEWTON_STEPS: Final = 12
"""For each increment of the load, at most."""

BALANCED: Final = 1e-8
"""Largest part of a wrench that a pose may leave over [N]."""

INCREMENT: Final = 1.0
"""Increment of the load along each direction; halved where the next load does not hold [N]."""

FINEST: Final = 2.0**-7
"""Increment at which a direction is done [N]."""

LARGEST: Final = 1e4
"""Load at which a direction is given up [N]."""

GOLDEN: Final = np.pi * (3.0 - np.sqrt(5.0))
"""Golden angle, by which points of a spiral spread evenly."""


@dataclass(frozen=True, eq=False)
class Pulled:
    """Wrenches and poses at which a gripper lets go.

    Attributes
    ----------
    wrenches : ndarray, shape (m, 3)
        Last wrenches that hold [N, N, N·m].
    poses : ndarray, shape (m, 3)
        Poses of the wrist there, (x, z, ω_y) [m, rad].
    side, phalanx : tuple of (str or None), length m
        The tile that fails; None where no pose balances the next load.
    way : tuple of str, length m
        The name of the tile's limit, or ``dragged_backwards``, or ``no_pose``.
    """

    wrenches: Array
    poses: Array
    side: tuple[str | None, ...]
    phalanx: tuple[str | None, ...]
    way: tuple[str, ...]


def explored(gripper: Gripper, count: int, progress: Progress) -> tuple[WristSearch, Pulled, Array]:
    """Search a gripper's poses, then pull it along about ``count`` directions.

    Also returned are the outermost wrenches of the search and those of the pulls, shape (n, 3).

    Raises
    ------
    EmptySetError
        If it does not hold without load.
    """
    unloaded(gripper)
    found = search(gripper, PER_AXIS, part(progress, 0, 1, 10))
    wrenches = in_paper_signs(found.wrenches)
    size = np.abs(clipped_vertices(wrenches)).max(axis=0)
    pulled = pull(gripper, even_pulls(count, size), part(progress, 1, 10, 10))
    # a pull that a search of poses has missed is held all the same
    return found, pulled, np.vstack([wrenches, pulled.wrenches])


def held_wrenches(gripper: Gripper) -> Array:
    """Return the outermost wrenches held by a gripper and its mirror image, shape (n, 3)."""
    return with_mirrored(in_paper_signs(search(gripper, PER_AXIS).wrenches))


def wrist_poses(gripper: Gripper, wrenches: Array, start: Array) -> tuple[Array, Array]:
    """Return the poses at which a gripper exerts some wrenches on the rock, by Newton steps.

    Parameters
    ----------
    gripper : Gripper
    wrenches : ndarray, shape (m, 3)
    start : ndarray, shape (m, 3)
        Poses to begin at, near the solutions.

    Returns
    -------
    poses : ndarray, shape (m, 3)
    residual : ndarray, shape (m,)
        Largest part of each wrench that is left over; not a number where a phalanx lost its rock
        [N].
    """
    poses, m = start.copy(), len(start)
    steps = 1j * STEP * np.eye(3)
    with np.errstate(invalid="ignore"):
        for _ in range(NEWTON_STEPS):
            moved = (poses[:, None, :] + steps).reshape(-1, 3)
            found = _wrenches(gripper, moved).reshape(m, 3, 3)
            left = found[:, 0].real - wrenches
            residual = np.abs(left * UNITS).max(axis=1)
            # tiny steps move no real part: all three rows have the wrench itself
            stiffness = found.imag.swapaxes(1, 2) / STEP
            going = (residual > BALANCED) & (np.abs(np.linalg.det(stiffness)) > 0.0)
            if not going.any():
                break
            poses[going] -= np.linalg.solve(stiffness[going], left[going, :, None])[..., 0]
        left = _wrenches(gripper, poses) - wrenches
    return poses, np.asarray(np.abs(left * UNITS).max(axis=1))


def unloaded(gripper: Gripper) -> Array:
    """Return the pose of a closed gripper that nothing loads, shape (3,) [m, rad].

    Raises
    ------
    EmptySetError
        If it does not hold itself.
    """
    poses = pulled_off_poses(gripper, np.zeros(1))
    if not (len(poses) and gripper.evaluate(poses).holds[0]):
        raise EmptySetError(
            "the gripper exceeds a limit before any load: the closing tension alone is too large"
        )
    return np.asarray(poses[0])


def pulled_off_poses(gripper: Gripper, pulls: Array) -> Array:
    """Return the poses at ascending pulls straight off [N], up to the last that can be balanced.

    Limits are not looked at.
    """
    at, poses = np.zeros((1, 3)), []
    for force in pulls:
        at, residual = wrist_poses(gripper, np.array([[0.0, -force, 0.0]]), at)
        if not residual[0] <= BALANCED:
            break
        poses.append(at[0])
    return np.array(poses)


def pull(gripper: Gripper, directions: Array, progress: Progress | None = None) -> Pulled:
    """Load a gripper along directions of the wrench until something lets go.

    Parameters
    ----------
    gripper : Gripper
    directions : ndarray, shape (m, 3)
        Of any length.
    progress : callable, optional
        Called with (directions done, directions in all) after each increment.

    Raises
    ------
    EmptySetError
        If it does not hold without load.
    """
    m = len(directions)
    unit = directions / np.linalg.norm(directions * UNITS, axis=1)[:, None]
    poses = np.repeat(unloaded(gripper)[None], m, axis=0)
    loads, increments = np.zeros(m), np.full(m, INCREMENT)
    tiles = [(side, phalanx) for side in SIDES for phalanx in PHALANGES]
    limits = gripper.limits
    fails: list[tuple[str | None, str | None, str]] = [(None, None, UNBALANCED)] * m
    going = np.ones(m, dtype=bool)
    while going.any():
        i = np.flatnonzero(going)
        tried, residual = wrist_poses(
            gripper, (loads[i] + increments[i])[:, None] * unit[i], poses[i]
        )
        found, balanced = gripper.evaluate(tried), residual <= BALANCED
        holds = found.holds & balanced
        poses[i[holds]] = tried[holds]
        loads[i[holds]] += increments[i[holds]]
        friction, fingers = gripper.surface.friction, gripper.finger_loads(tried)
        drags = np.concatenate([side.shears + friction * side.normals for side in fingers], axis=1)
        for k in np.flatnonzero(~holds):
            row = limits[found.limiting[k]]
            if not balanced[k]:
                fails[i[k]] = (None, None, UNBALANCED)
            elif found.utilisation[k] > 1.0:
                fails[i[k]] = (row.finger, row.phalanx, row.limit)
            else:
                fails[i[k]] = (*tiles[drags[k].argmin()], DRAGGED)
        over = i[~holds]
        increments[over] *= 0.5
        going[over] = increments[over] >= FINEST
        going &= loads < LARGEST
        if progress is not None:
            progress(m - int(going.sum()), m)
    sides, phalanges, ways = zip(*fails, strict=True)
    return Pulled(loads[:, None] * unit, poses, sides, phalanges, ways)


def even_pulls(count: int, size: Array) -> Array:
    """Return directions with F_z < 0, evenly spread where wrenches are measured by ``size``.

    On a spiral over half of a half sphere, and the same mirrored, (F_x, M_y) → (−F_x, −M_y).

    Parameters
    ----------
    count : int
        About how many.
    size : ndarray, shape (3,)
        Wrenches that count alike.

    Returns
    -------
    ndarray, shape (m, 3)
    """
    k = np.arange(count)
    height = (k + 0.5) / count
    turn = GOLDEN * k
    around = np.sqrt(1.0 - height**2)
    spiral = np.column_stack([around * np.cos(turn), -height, around * np.sin(turn)])
    half = spiral[spiral[:, 0] > 0.0]
    return np.vstack([half, half * (-1.0, 1.0, -1.0)]) * size


def _wrenches(gripper: Gripper, poses: Numbers) -> Numbers:
    return in_paper_signs(gripper.loads_at(poses).wrenches)
