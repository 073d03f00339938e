"""Pull a planar gripper along directions of the wrench until a tile's limit (Section 5.5.2).

The pose of the wrist follows the load in small increments, each solved by Newton steps on exact
stiffnesses (Section 5.4.2). A set of wrenches need not be convex; its hull does not show the
boundary of the set, nor the limit that is exceeded there, and these pulls do. Wrenches are
(F_x, F_z, M_y) in the paper's signs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, EmptySetError, Progress
from hand_models.compliance import (
    COMPLEX_STEP,
    GRIPPER_SIDES,
    FingerLoads,
    Gripper,
    Numbers,
    WristSearch,
    search_grid,
)
from hand_models.experiments.study_result import part
from hand_models.experiments.wrench_hull import (
    PLANAR_SCALE,
    clipped_vertices,
    in_paper_signs,
    with_mirrored,
)
from hand_models.finger import PHALANGES

__all__ = [
    "Pulled",
    "balance_matrix",
    "even_pulls",
    "explored",
    "held_wrenches",
    "pull",
    "pulled_off_poses",
    "unloaded",
    "wrist_poses",
]


@dataclass(frozen=True, slots=True)
class PullingSettings:
    """Resolution of the search for a gripper's poses, and tolerance of their balance."""

    poses_per_axis: int = 60
    """Number of poses of the wrist along each axis of a search."""
    balance_tolerance: float = 1e-8
    """Largest residual of a wrench at a balanced pose, its moment over 0.1 m [N]."""
    first_increment: float = 8.0
    """First increment of a load, halved where the next load does not hold [N].

    From 1 to 8 N, each last load that holds is the same, as each increment is solved exactly.
    """


PULLING_SETTINGS: Final = PullingSettings()


@dataclass(frozen=True, eq=False)
class Pulled:
    """Result of `pull`: last wrench and pose along m directions before a gripper exceeds a limit.

    Attributes
    ----------
    wrenches : ndarray, shape (m, 3)
        Last wrenches that hold [N, N, N·m].
    poses : ndarray, shape (m, 3)
        Poses of the wrist there, (x, z, ω_y) [m, m, rad].
    side, phalanx : tuple of (str or None), length m
        The tile that fails; None where no pose balances the next load.
    way : tuple of str, length m
        The name of the tile's limit, or ``dragged_backwards`` where a tile has less drag than it
        needs (`Surface`), or ``no_pose`` where no pose balances the next load.
    """

    wrenches: Array
    poses: Array
    side: tuple[str | None, ...]
    phalanx: tuple[str | None, ...]
    way: tuple[str, ...]


def explored(gripper: Gripper, count: int, progress: Progress) -> tuple[WristSearch, Pulled, Array]:
    """Search the poses of a gripper's wrist, then pull it along about ``count`` directions.

    Parameters
    ----------
    gripper : Gripper
    count : int
        Approximate number of directions.
    progress : Progress
        Called with (steps done, steps in all).

    Returns
    -------
    search : WristSearch
        Result of the search over poses.
    pulled : Pulled
        Result of the pulls.
    wrenches : ndarray, shape (n, 3)
        Outermost wrenches of the search, and those of the pulls [N, N, N·m].

    Raises
    ------
    EmptySetError
        If the closed gripper exceeds a limit without load.
    """
    unloaded(gripper)
    found = search_grid(gripper, PULLING_SETTINGS.poses_per_axis, part(progress, 0, 1, 10))
    wrenches = in_paper_signs(found.wrenches)
    size = np.abs(clipped_vertices(wrenches)).max(axis=0)
    pulled = pull(gripper, even_pulls(count, size), part(progress, 1, 10, 10))
    # a pull that a search of poses has missed is held all the same
    return found, pulled, np.vstack([wrenches, pulled.wrenches])


def held_wrenches(gripper: Gripper) -> Array:
    """Search a gripper's poses, and return the outermost wrenches that it can hold.

    Returns
    -------
    ndarray, shape (n, 3)
        Wrenches (F_x, F_z, M_y) and their mirror images, in the paper's signs [N, N, N·m].
    """
    found = search_grid(gripper, PULLING_SETTINGS.poses_per_axis)
    return with_mirrored(in_paper_signs(found.wrenches))


def wrist_poses(gripper: Gripper, wrenches: Array, start: Array) -> tuple[Array, Array]:
    """Find the poses at which a gripper exerts given wrenches on the rock, by Newton steps.

    Parameters
    ----------
    gripper : Gripper
    wrenches : ndarray, shape (m, 3)
        (F_x, F_z, M_y) in the paper's signs [N, N, N·m].
    start : ndarray, shape (m, 3)
        Poses (x, z, ω_y) to begin at, near the solutions [m, m, rad].

    Returns
    -------
    poses : ndarray, shape (m, 3)
        Poses (x, z, ω_y) [m, m, rad].
    residual : ndarray, shape (m,)
        Largest component of the difference between given and exerted wrench, the moment divided by
        0.1 m; NaN where a phalanx lost its rock [N].
    """
    poses, m = start.copy(), len(start)
    steps = 1j * COMPLEX_STEP * np.eye(3)
    with np.errstate(invalid="ignore"):
        for _ in range(12):  # Newton steps for each increment of the load, at most
            moved = (poses[:, None, :] + steps).reshape(-1, 3)
            found = _wrenches(gripper, moved).reshape(m, 3, 3)
            left = found[:, 0].real - wrenches
            residual = np.abs(left * PLANAR_SCALE).max(axis=1)
            # tiny steps move no real part: all three rows have the wrench itself
            stiffness = found.imag.swapaxes(1, 2) / COMPLEX_STEP
            going = residual > PULLING_SETTINGS.balance_tolerance
            going &= np.abs(np.linalg.det(stiffness)) > 0.0
            if not going.any():
                break
            poses[going] -= np.linalg.solve(stiffness[going], left[going, :, None])[..., 0]
        left = _wrenches(gripper, poses) - wrenches
    return poses, np.asarray(np.abs(left * PLANAR_SCALE).max(axis=1))


def unloaded(gripper: Gripper) -> Array:
    """Return the pose of a closed gripper without load, (x, z, ω_y), shape (3,) [m, m, rad].

    Raises
    ------
    EmptySetError
        If the closed gripper exceeds a limit without load.
    """
    poses = pulled_off_poses(gripper, np.zeros(1))
    if not (len(poses) and gripper.evaluate(poses).holds[0]):
        raise EmptySetError(
            "the gripper exceeds a limit before any load: the closing tension alone is too large; "
            "lower it"
        )
    return np.asarray(poses[0])


def pulled_off_poses(gripper: Gripper, pulls: Array) -> Array:
    """Return the poses of a gripper at pulls straight off the rock, up to the last one in balance.

    Limits of the tiles are not checked.

    Parameters
    ----------
    gripper : Gripper
    pulls : ndarray, shape (n,)
        Ascending values of −F_z [N].

    Returns
    -------
    ndarray, shape (k, 3)
        (x, z, ω_y) for the first k ≤ n pulls [m, m, rad].
    """
    at, poses = np.zeros((1, 3)), []
    for force in pulls:
        at, residual = wrist_poses(gripper, np.array([[0.0, -force, 0.0]]), at)
        if not residual[0] <= PULLING_SETTINGS.balance_tolerance:
            break
        poses.append(at[0])
    return np.array(poses)


def balance_matrix(gripper: Gripper, poses: Array, loads: FingerLoads) -> Array:
    """Return A of Eq. 7 for one finger, A f_c = b, in SI units, shape (m, 6, 6).

    f_c is the force of each of three contacts on the rock, (x, z) in the finger's frame F, proximal
    first. A takes f_c to the torques of three joints (Jᵀ; from x toward z) [m], and to the three
    components along the phalanges (P_x) [1]. The condition number depends on these two units.

    Parameters
    ----------
    gripper : Gripper
    poses : ndarray, shape (m, 3)
        Poses (x, z, ω_y) of the wrist, with x = ω_y = 0 [m, m, rad].
    loads : FingerLoads
        Loads of the finger at these poses.
    """
    u = np.asarray(loads.directions, dtype=float)
    # of each joint, proximal first: the base, and where the phalanges before it end
    ends = gripper.finger.model.joint_spacing * np.cumsum(u[:, :-1], axis=1)
    joints = np.pad(ends, ((0, 0), (1, 0), (0, 0))) + poses[:, None, :2]
    arms = loads.points[:, None] - joints[:, :, None]
    turned = np.stack([-arms[..., 1], arms[..., 0]], axis=-1)
    # a joint bears the contacts beyond it; along a phalanx there is its own
    each = np.eye(len(PHALANGES))[:, :, None]
    rows = [turned * each.cumsum(axis=1), u[:, None] * each]
    return np.concatenate(rows, axis=1).reshape(len(poses), 6, 6)


def pull(gripper: Gripper, directions: Array, progress: Progress | None = None) -> Pulled:
    """Load a gripper along directions of the wrench until a limit is exceeded.

    Parameters
    ----------
    gripper : Gripper
    directions : ndarray, shape (m, 3)
        Directions in (F_x, F_z, M_y), of any length.
    progress : callable, optional
        Called with (directions done, directions in all) after each increment.

    Returns
    -------
    Pulled
        For each direction the last wrench and pose within every limit, and the limit that the next
        increment exceeds.

    Raises
    ------
    EmptySetError
        If the closed gripper exceeds a limit without load.
    """
    m = len(directions)
    unit = directions / np.linalg.norm(directions * PLANAR_SCALE, axis=1)[:, None]
    poses = np.repeat(unloaded(gripper)[None], m, axis=0)
    balanced_to = PULLING_SETTINGS.balance_tolerance
    # [N], halved where the next load does not hold
    loads, increments = np.zeros(m), np.full(m, PULLING_SETTINGS.first_increment)
    tiles = [(side, phalanx) for side in GRIPPER_SIDES for phalanx in PHALANGES]
    limits = gripper.limits
    fails: list[tuple[str | None, str | None, str]] = [(None, None, "no_pose")] * m
    going = np.ones(m, dtype=bool)
    while going.any():
        i = np.flatnonzero(going)
        tried, residual = wrist_poses(
            gripper, (loads[i] + increments[i])[:, None] * unit[i], poses[i]
        )
        found, balanced = gripper.evaluate(tried), residual <= balanced_to
        holds = found.holds & balanced
        poses[i[holds]] = tried[holds]
        loads[i[holds]] += increments[i[holds]]
        friction, fingers = gripper.surface.friction, gripper.finger_loads(tried)
        drags = np.concatenate([side.shears + friction * side.normals for side in fingers], axis=1)
        for k in np.flatnonzero(~holds):
            row = limits[found.limiting[k]]
            if not balanced[k]:
                fails[i[k]] = (None, None, "no_pose")
            elif found.utilisation[k] > 1.0:
                fails[i[k]] = (row.finger, row.phalanx, row.limit)
            else:
                fails[i[k]] = (*tiles[drags[k].argmin()], "dragged_backwards")
        over = i[~holds]
        increments[over] *= 0.5
        going[over] = increments[over] >= 2.0**-7  # [N], where a direction is done
        going &= loads < 1e4  # [N], where a direction is given up
        if progress is not None:
            progress(m - int(going.sum()), m)
    sides, phalanges, ways = zip(*fails, strict=True)
    return Pulled(loads[:, None] * unit, poses, sides, phalanges, ways)


def even_pulls(count: int, size: Array) -> Array:
    """Return directions of wrenches with F_z < 0, evenly spread when divided by ``size``.

    Half of them lie on a spiral over a quarter of a sphere; the others are their mirror images,
    (F_x, M_y) → (−F_x, −M_y).

    Parameters
    ----------
    count : int
        Approximate number of directions.
    size : ndarray, shape (3,)
        Scale of F_x, F_z and M_y [N, N, N·m].

    Returns
    -------
    ndarray, shape (m, 3)
        Directions (F_x, F_z, M_y) in the paper's signs [N, N, N·m].
    """
    k = np.arange(count)
    height = (k + 0.5) / count
    # by the golden angle, which spreads a spiral's points evenly
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    around = np.sqrt(1.0 - height**2)
    spiral = np.column_stack([around * np.cos(turn), -height, around * np.sin(turn)])
    half = spiral[spiral[:, 0] > 0.0]
    return np.vstack([half, half * (-1.0, 1.0, -1.0)]) * size


def _wrenches(gripper: Gripper, poses: Numbers) -> Numbers:
    return in_paper_signs(gripper.loads_at(poses).wrenches)
