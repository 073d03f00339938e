"""The reach table: joint angles of every limb for every placement and pose of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, Pose, go_on, stored
from planner import deadline
from planner.limbs import LimbChain
from planner.motion import CollisionScene, Rock, distances_from_rock
from planner.reach.settings import REACH_SETTINGS
from planner.reach.starts import Starts
from planner.robots import Robot, scene_number

__all__ = ["ReachTable", "reach_poses", "reach_table"]

Fits = Callable[[Array, Indices], NDArray[np.bool_]]
"""Says which of some joint angles (S, n) of the poses with indices (S,) are wanted, (S,)."""


@dataclass(frozen=True, eq=False)
class ReachTable:
    """Joint angles with which limbs reach placements from poses of the body, as plain arrays.

    Attributes
    ----------
    entry : ndarray of int, shape (P, B, L)
        Index of each placement, body and limb among the E that are reached; −1 where no joint
        angles were found, which proves nothing where the placement is within the limb's span.
    spanned : ndarray of bool, shape (P, B, L)
        False where the placement is farther than the stretched limb: no angles can reach it.
    starts : ndarray of int, shape (E + 1,)
        Index of the first solution of each entry.
    angles : ndarray, shape (A, n)
        Joint angles of all solutions [rad]; zero beyond the last joint of a limb of fewer joints.
    """

    entry: Indices
    spanned: NDArray[np.bool_]
    starts: Indices
    angles: Array

    @classmethod
    def of(cls, counts: Indices, spanned: NDArray[np.bool_], angles: Sequence[Array]) -> ReachTable:
        """Return the table of solutions that are given limb by limb.

        Parameters
        ----------
        counts : ndarray of int, shape (P, B, L)
            Number of solutions for each placement, body and limb.
        spanned : ndarray of bool, shape (P, B, L)
        angles : sequence of ndarray, length L
            Solutions (A, n) of each limb, by placement, then by body [rad].
        """
        flat = np.moveaxis(counts, 2, 0)
        entry = np.full(flat.shape, -1, dtype=np.intp)
        entry[flat > 0] = np.arange(int((flat > 0).sum()))
        most = max(each.shape[1] for each in angles)
        return cls(
            entry=np.ascontiguousarray(np.moveaxis(entry, 0, 2)),
            spanned=spanned,
            starts=np.cumsum(np.append(0, flat[flat > 0])),
            angles=np.concatenate([np.pad(a, ((0, 0), (0, most - a.shape[1]))) for a in angles]),
        )

    @classmethod
    def joined(cls, tables: Sequence[ReachTable]) -> ReachTable:
        """Return the table of all placements of several tables, of the same bodies and limbs."""
        counts = np.concatenate([each.counts for each in tables])
        spanned = np.concatenate([each.spanned for each in tables])
        angles = [
            np.concatenate([each._of_limb(limb) for each in tables])
            for limb in range(counts.shape[2])
        ]
        return cls.of(counts, spanned, angles)

    def beside(self, other: ReachTable) -> ReachTable:
        """Return the table of the bodies of both, of the same placements and limbs.

        Parameters
        ----------
        other : ReachTable
            Of the bodies that come after those of this one.
        """
        pairs = [(self.counts, self), (other.counts, other)]
        counts = np.concatenate([each for each, _ in pairs], axis=1)
        angles = list[Array]()
        for limb in range(counts.shape[2]):
            # by placement, first those of this table's bodies
            owners = [np.repeat(np.arange(len(c)), c[:, :, limb].sum(axis=1)) for c, _ in pairs]
            every = np.concatenate([table._of_limb(limb) for _, table in pairs])
            angles.append(every[np.argsort(np.concatenate(owners), kind="stable")])
        return self.of(counts, np.concatenate([self.spanned, other.spanned], axis=1), angles)

    @property
    def counts(self) -> Indices:
        """Number of solutions of each placement, body and limb, shape (P, B, L)."""
        found = np.zeros(self.entry.shape, dtype=np.intp)
        found[self.reached] = np.diff(self.starts)[self.entry[self.reached]]
        return found

    def _of_limb(self, limb: int) -> Array:
        """Return all solutions of one limb, by placement, then by body."""
        first = int((self.entry[:, :, :limb] >= 0).sum())
        end = first + int((self.entry[:, :, limb] >= 0).sum())
        return self.angles[self.starts[first] : self.starts[end]]

    @property
    def reached(self) -> NDArray[np.bool_]:
        """True where a limb reaches a placement from a body, shape (P, B, L)."""
        found: NDArray[np.bool_] = self.entry >= 0
        return found

    def branches(self, placement: int, body: int, limb: int) -> Array:
        """Return the solutions of one limb, shape (a, n) [rad]; a = 0 if none was found."""
        at = int(self.entry[placement, body, limb])
        return self.angles[:0] if at < 0 else self.angles[self.starts[at] : self.starts[at + 1]]


def reach_poses(
    chain: LimbChain,
    starts: Starts,
    targets: Array,
    branches: int = REACH_SETTINGS.branches,
    fits: Fits | None = None,
) -> tuple[Array, Indices]:
    """Return joint angles of a limb for many poses of its hand.

    Damped least squares start from random postures whose hands are near each pose: from a few, and
    from more for poses of which these find no solution that fits. Only the span of the limb leaves
    out poses that are not tried.

    Parameters
    ----------
    chain : LimbChain
    starts : Starts
        Random postures of the same limb.
    targets : ndarray, shape (N, 3, 4)
        Axes and origins of the poses of H in B.
    branches : int
        Most solutions of a pose; two of them differ by more than `ReachSettings.alike` in a joint.
    fits : callable, optional
        Says which joint angles (S, n) of which poses (S,) may be returned; all by default.

    Returns
    -------
    angles : ndarray, shape (A, n)
        Joint angles within their limits, pose by pose [rad].
    count : ndarray of int, shape (N,)
        Number of solutions of each pose.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    settings = REACH_SETTINGS
    numbers = np.array(
        [
            settings.pose_error,
            settings.damping,
            settings.least_damping,
            settings.longest_step,
            settings.alike,
            settings.early_steps,
        ]
    )
    count = np.zeros(len(targets), dtype=np.intp)
    kept, whose = list[Array](), list[Indices]()
    left = np.flatnonzero(chain.spans(targets) <= 1.0 + settings.pose_error)
    ends = (0, settings.starts, settings.starts + settings.more_starts)
    for first, end in pairwise(ends):
        # where none of the first ones fits, others may
        most = branches if first == 0 or fits is None else end - first
        for at in range(0, len(left), settings.at_once):
            deadline.check("the reach of all limbs was known")
            go_on()
            some = left[at : at + settings.at_once]
            asked = np.ascontiguousarray(targets[some])
            near = starts.near(asked, first, end)
            angles, found = chain.solve(asked, near, numbers, settings.steps, most)
            solved = np.arange(most) < found[:, None]
            owners, flat = np.repeat(some, found), angles[solved]
            if fits is not None and len(flat):
                good = fits(flat, owners)
                owners, flat = owners[good], flat[good]
            if most > branches:
                # the first ones of each pose
                rank = np.arange(len(owners)) - np.searchsorted(owners, owners)
                owners, flat = owners[rank < branches], flat[rank < branches]
            kept.append(flat)
            whose.append(owners)
            count += np.bincount(owners, minlength=len(targets))
        left = left[count[left] == 0]
    if not kept:
        return np.zeros((0, len(chain.lower))), count
    order = np.argsort(np.concatenate(whose), kind="stable")
    return np.concatenate(kept)[order], count


def reach_table(
    robot: Robot,
    placements: Sequence[Pose],
    bodies: Sequence[Pose],
    *,
    branches: int = REACH_SETTINGS.branches,
    limbs: Sequence[str] | None = None,
    clear: bool = True,
    rock: Rock | None = None,
) -> ReachTable:
    """Return which placements a robot's hands reach from which poses of its body.

    The other limbs are not looked at.

    Parameters
    ----------
    robot : Robot
    placements : sequence of Pose, length P
        Poses of H in the world frame W.
    bodies : sequence of Pose, length B
        Poses of B in W.
    branches : int
        Most solutions that are kept for each.
    limbs : sequence of str, optional
        Limbs of the table, in its order; all by default.
    clear : bool
        Whether solutions are left out in which the capsules of a limb and its hand meet those of
        the body, or each other.
    rock : Rock, optional
        Solutions are left out in which the capsules of a limb are in this rock, or nearer to it
        than hands at their holds may be; the last links with the hand may touch it.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    names = robot.limbs if limbs is None else tuple(limbs)
    targets = _poses_in_bodies(placements, bodies)
    shape = len(placements), len(bodies), len(names)
    counts, spanned = np.zeros(shape, dtype=np.intp), np.zeros(shape, dtype=bool)
    found = list[Array]()
    scene = CollisionScene(robot, ())
    for i, limb in enumerate(names):
        chain, starts = _limb_postures(robot, limb)
        filters = [_clear_of_itself(scene, limb)] if clear else []
        if rock is not None:
            filters.append(_clear_of_rock(scene, limb, rock, bodies))
        fits = _all_of(filters) if filters else None
        angles, count = reach_poses(chain, starts, targets, branches, fits)
        found.append(angles)
        counts[:, :, i] = count.reshape(shape[:2])
        spanned[:, :, i] = (chain.spans(targets) <= 1.0 + REACH_SETTINGS.pose_error).reshape(
            shape[:2]
        )
    return ReachTable.of(counts, spanned, found)


@stored("starts of limbs", 32)
def _limb_postures(robot: Robot, limb: str) -> tuple[LimbChain, Starts]:
    """Return a limb's constants and its random postures."""
    chain = LimbChain.of(robot, limb)
    return chain, Starts(chain)


def _poses_in_bodies(placements: Sequence[Pose], bodies: Sequence[Pose]) -> Array:
    """Return axes and origins (P B, 3, 4) in B of all placements from all bodies."""
    turns = np.array([each.rotation for each in placements]).reshape(-1, 1, 3, 3)
    places = np.array([each.position for each in placements]).reshape(-1, 1, 3)
    axes = np.array([each.rotation for each in bodies]).reshape(1, -1, 3, 3)
    origins = np.array([each.position for each in bodies]).reshape(1, -1, 3)
    inverse = axes.swapaxes(2, 3)
    moved = inverse @ (places - origins)[..., None]
    return np.ascontiguousarray(np.concatenate([inverse @ turns, moved], axis=3)).reshape(-1, 3, 4)


def _clear_of_itself(scene: CollisionScene, limb: str) -> Fits:
    """Return a function that says which joint angles of a limb keep it off the body and itself."""
    from planner.motion import capsule_distances

    mine = np.append(np.arange(len(scene.body)), scene.own[limb])
    within = np.isin(scene.pairs, mine).all(axis=1) & np.isin(scene.pairs, scene.own[limb]).any(1)
    pairs = np.searchsorted(mine, scene.pairs[within])
    radii, capsules = scene.radii[mine], scene.limbs[limb]

    def fits(angles: Array, _: Indices) -> NDArray[np.bool_]:
        body = np.broadcast_to(scene.body, (len(angles), *scene.body.shape))
        segments = np.ascontiguousarray(np.hstack([body, capsules.segments(angles)]))
        away = capsule_distances(segments, radii, pairs, 0.0)
        return np.asarray(away.min(axis=1, initial=0.0) >= 0.0)

    return fits


def _all_of(filters: Sequence[Fits]) -> Fits:
    """Return a function that wants what all filters want; each is asked for what is left."""

    def fits(angles: Array, owners: Indices) -> NDArray[np.bool_]:
        found = np.ones(len(angles), dtype=bool)
        for each in filters:
            left = np.flatnonzero(found)
            if len(left):
                found[left] = each(angles[left], owners[left])
        return found

    return fits


def _clear_of_rock(scene: CollisionScene, limb: str, rock: Rock, bodies: Sequence[Pose]) -> Fits:
    """Return a function that says which joint angles keep a limb but its hand off the rock."""
    capsules, own = scene.limbs[limb], scene.own[limb]
    # the last joint moves the hand and what is next to it, which may touch
    free = np.flatnonzero(capsules.steps < capsules.steps.max())
    along = np.linspace(0.0, 1.0, 5)[:, None]
    # room also for the way to the next pose of the body, and for what lies between the points
    margin = 2.0 * scene_number("motion", "margin_at_hold")
    # a limb that is deeper in the rock somewhere goes through its surface elsewhere
    far = 2.0 * float((scene.radii[own[free]] + margin).max())
    into = [rock.pose.inverse() @ body for body in bodies]
    turns, origins = (
        np.array([at.rotation for at in into]),
        np.array([at.position for at in into]),
    )

    def fits(angles: Array, owners: Indices) -> NDArray[np.bool_]:
        segments = capsules.segments(angles)[:, free]
        first, last = segments[:, :, None, 0], segments[:, :, None, 1]
        points = (first + along * (last - first)).reshape(len(angles), -1, 3)
        body = owners % len(bodies)
        there = points @ turns[body].mT + origins[body, None]
        away = distances_from_rock(rock.hold, np.ascontiguousarray(there.reshape(-1, 3)), far)
        gaps = away.reshape(*segments.shape[:2], -1).min(axis=2) - scene.radii[own[free]]
        return np.asarray(gaps.min(axis=1, initial=np.inf) >= margin)

    return fits
