"""Clearance of a robot's links and hands from each other and from rock, at many postures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Pose
from planner.motion.branch import pose_between
from planner.motion.compiled_capsules import capsule_distances
from planner.motion.limb_capsules import LimbCapsules
from planner.motion.rocks import Rock, distances_from_rock
from planner.motion.settings import MOTION_SETTINGS
from planner.robots import Robot
from planner.scene import palm_capsule, unjoined_pairs

__all__ = ["CollisionScene", "JointSpace", "NearestPair"]


class NearestPair(NamedTuple):
    """The two things that are nearest to each other.

    Attributes
    ----------
    first, second : str
        Names: of a link, ``hand of front_left``, ``rock of front_left``, ``body``.
    distance : float
        Distance [m]; negative where they overlap.
    """

    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        if self.distance < 0.0:
            return f"{self.first} is {-1e3 * self.distance:.3g} mm deep in {self.second}"
        return f"{self.first} comes to {1e3 * self.distance:.3g} mm from {self.second}"


class CollisionScene:
    """A robot with its hands, as N capsules, and the rock about it.

    Parameters
    ----------
    robot : Robot
    rocks : sequence of Rock
        All holds of a climb that the robot can meet.

    Attributes
    ----------
    robot, rocks
        The parameters.
    names : tuple of str, length N
        Of each capsule: the robot's (`Robot.capsules`), then the hands'.
    radii : ndarray, shape (N,)
        Radii of the capsules [m].
    pairs : ndarray of int, shape (k, 2)
        Capsules that may meet.
    limbs : dict of str to LimbCapsules
        Capsules of each limb.
    own : dict of str to ndarray of int
        Indices of the capsules of each limb, its hand's last.
    body : ndarray, shape (b, 2, 3)
        Segments of the body's capsules, which are the first [m].
    """

    def __init__(self, robot: Robot, rocks: Sequence[Rock]) -> None:
        self.robot, self.rocks = robot, tuple(rocks)
        capsules, limbs = robot.capsules, robot.limbs
        _, palm = palm_capsule(robot.hand)
        named = zip(capsules.names, capsules.limbs, strict=True)
        names = ["body" if limb is None else name for name, limb in named]
        self.names = (*names, *(f"hand of {limb}" for limb in limbs))
        self.radii = np.append(capsules.radii, np.full(len(limbs), palm))
        self.pairs = unjoined_pairs(robot, limbs, self.radii)
        self.limbs = {limb: LimbCapsules(robot, limb) for limb in limbs}
        owners = np.array([str(limb) for limb in (*capsules.limbs, *limbs)])
        self.own = {limb: np.flatnonzero(owners == limb) for limb in limbs}
        self.body, _ = robot.body_capsules

    def placed(self, joints: Mapping[str, Array]) -> Array:
        """Return the segments of all capsules in B at a posture, shape (N, 2, 3) [m].

        Parameters
        ----------
        joints : mapping of str to ndarray, shape (n,)
            Angles of limbs' joints [rad]; capsules of a limb left out are not numbers (NaN).
        """
        found = np.full((len(self.radii), 2, 3), np.nan)
        found[: len(self.body)] = self.body
        for limb, angles in joints.items():
            given = np.asarray(angles, dtype=float)[None]
            found[self.own[limb]] = self.limbs[limb].segments(given)[0]
        return found

    def nearest(self, body: Pose, joints: Mapping[str, Array]) -> NearestPair:
        """Return what is nearest to each other at one posture, with all hands on their rock.

        A hand, with the links that its limb's last joint moves, may touch rock.

        Parameters
        ----------
        body : Pose
            Pose of B in W.
        joints : mapping of str to ndarray, shape (n,)
            Angles of limbs' joints [rad]; a limb left out is not measured.
        """
        limbs = tuple(joints)
        # both ends of a motion of the body are where it is: so the body is measured, too
        whole = JointSpace(self, [body, body], joints, limbs, touching=limbs)
        return whole.nearest(whole.start)


class JointSpace:
    """Clearances over the joint angles of some limbs, and over a motion of the body.

    A posture x, shape (d,), has the angles of these limbs one after the other. Where the body
    moves, x ends with its progress: i at the i-th of the body's poses; between two of them its
    position is on a straight line, and its orientation turns the shortest way.

    Parameters
    ----------
    scene : CollisionScene
    bodies : sequence of Pose
        Poses of B in W, one after the other; only one if the body stays.
    joints : mapping of str to ndarray, shape (n,)
        Angles of limbs' joints [rad]; a limb left out is not measured.
    limbs : sequence of str
        Limbs that move, of those in ``joints``.
    touching : collection of str
        Limbs whose hand holds rock: with the links that the last joint moves, it is not measured
        from its own (`Rock.limbs`), nor from what else it touches at the start.

    Attributes
    ----------
    start, lower, upper : ndarray, shape (d,)
        Posture that ``joints`` gives, with the body at its first pose, and the limits [rad].
    """

    def __init__(
        self,
        scene: CollisionScene,
        bodies: Sequence[Pose],
        joints: Mapping[str, Array],
        limbs: Sequence[str],
        *,
        touching: Collection[str],
    ) -> None:
        self.scene, self.limbs, self._bodies = scene, tuple(limbs), list(bodies)
        chains = [scene.robot.chains[limb] for limb in limbs]
        progress = [0.0] if len(bodies) > 1 else []
        self.start = np.concatenate([*(joints[limb] for limb in limbs), progress])
        self.lower = np.concatenate([*(chain.lower for chain in chains), progress])
        last = [len(bodies) - 1.0] if len(bodies) > 1 else []
        self.upper = np.concatenate([*(chain.upper for chain in chains), last])
        ends = np.cumsum([0, *(len(chain.joints) for chain in chains)])
        self._parts = [slice(a, b) for a, b in pairwise(ends.tolist())]
        self._still = scene.placed(joints)
        self._measured = np.concatenate(
            [*([np.arange(len(scene.body))] if last else []), *(scene.own[limb] for limb in limbs)]
        )
        known = np.asarray(np.isfinite(self._still[:, 0, 0]))[scene.pairs].all(axis=1)
        moves = np.isin(scene.pairs, [each for limb in limbs for each in scene.own[limb]])
        self._pairs = np.ascontiguousarray(scene.pairs[known & moves.any(axis=1)])
        self._spread_points()
        self._met = np.ones((len(scene.rocks), len(self._measured)), dtype=bool)
        self._leave_out(touching)
        self._levers = self._bounds()

    def _spread_points(self) -> None:
        """Find places along the measured capsules from which rock is measured."""
        segments = self._still[self._measured]
        lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
        counts = np.ceil(lengths / MOTION_SETTINGS.point_spacing).astype(int) + 1
        self._whose = np.repeat(self._measured, counts)
        self._along = np.concatenate([np.linspace(0.0, 1.0, n) for n in counts.tolist()])[:, None]
        self._first = np.cumsum([0, *counts[:-1]])
        self._gaps = 0.5 * lengths / np.maximum(counts - 1, 1)

    def _leave_out(self, touching: Collection[str]) -> None:
        """Leave hands that hold rock, and their links, out of what is measured from it."""
        away = self._from_rocks(self._still[None], self.start[None], MOTION_SETTINGS.farthest)[0]
        for limb in set(touching) & set(self.limbs):
            steps, own = self.scene.limbs[limb].steps, self.scene.own[limb]
            last = np.isin(self._measured, own[steps == steps[-1]])
            hand = int(np.flatnonzero(self._measured == own[-1])[0])
            for row, rock, distances in zip(self._met, self.scene.rocks, away, strict=True):
                if limb in rock.limbs or distances[hand] < MOTION_SETTINGS.touch:
                    row[last] = False

    def _bounds(self) -> Array:
        """Return how fast the distances of all columns change at most, shape (P, d)."""
        scene, count = self.scene, len(self.scene.radii)
        every, reaches = np.zeros((count, len(self.start))), np.zeros(count)
        reaches[: len(scene.body)] = np.linalg.norm(scene.body, axis=2).max(axis=1, initial=0.0)
        steps, whose = np.zeros(count, dtype=int), np.full(count, -1)
        for i, (limb, part) in enumerate(zip(self.limbs, self._parts, strict=True)):
            at, capsules = scene.own[limb], scene.limbs[limb]
            every[at, part], reaches[at] = capsules.levers, capsules.reaches
            steps[at], whose[at] = capsules.steps, i
        inner, outer = self._pairs.T
        swapped = steps[inner] > steps[outer]
        inner, outer = np.where(swapped, outer, inner), np.where(swapped, inner, outer)
        apart = every[inner] + every[outer]
        # of two capsules of one limb only the joints between them matter
        for k in np.flatnonzero((whose[inner] == whose[outer]) & (whose[inner] >= 0)).tolist():
            i = whose[outer[k]]
            coupling = scene.robot.chains[self.limbs[i]].coupling
            between = coupling[steps[inner[k]] : steps[outer[k]]].any(axis=0)
            apart[k] = 0.0
            apart[k, self._parts[i]] = every[outer[k], self._parts[i]] * between
        if len(self._bodies) > 1:
            moved = [first.inverse() @ second for first, second in pairwise(self._bodies)]
            shift = max(float(np.linalg.norm(each.position)) for each in moved)
            cosine = min(float(np.trace(each.rotation)) for each in moved) / 2.0 - 0.5
            every[:, -1] = shift + np.arccos(np.clip(cosine, -1.0, 1.0)) * reaches
        return np.concatenate([apart, *(every[self._measured[met]] for met in self._met)])

    def clearances(self, postures: Array, far: float | None = None) -> Array:
        """Return the distances of all pairs that may meet, shape (S, P) [m].

        First of capsules, then of each rock's. They are lower bounds, exact near contact but for
        the spacing of points along a capsule.

        Parameters
        ----------
        postures : ndarray, shape (S, d)
            Postures of the moving limbs [rad].
        far : float, optional
            Distance up to which they are needed [m]; `MotionSettings.farthest` by default.
        """
        far = MOTION_SETTINGS.farthest if far is None else far
        placed = np.repeat(self._still[None], len(postures), axis=0)
        for limb, part in zip(self.limbs, self._parts, strict=True):
            placed[:, self.scene.own[limb]] = self.scene.limbs[limb].segments(postures[:, part])
        apart = capsule_distances(placed, self.scene.radii, self._pairs, far)
        rocks = self._from_rocks(placed, postures, far)
        return np.concatenate([apart, rocks[:, self._met]], axis=1)

    def _from_rocks(self, placed: Array, postures: Array, far: float) -> Array:
        """Return the distances of the measured capsules from all rock, (S, rocks, c) [m]."""
        count, radii = len(placed), self.scene.radii[self._measured]
        first, second = placed[:, self._whose, 0], placed[:, self._whose, 1]
        points = first + self._along * (second - first)
        found = np.empty((count, len(self.scene.rocks), len(radii)))
        bodies = [self._bodies[0]] if len(self._bodies) == 1 else self._on_way(postures[:, -1])
        turns = np.array([body.rotation for body in bodies])
        points = points @ turns.mT + np.array([body.position for body in bodies])[:, None]
        most, gaps = far + float((radii + self._gaps).max()), self._gaps
        for i, rock in enumerate(self.scene.rocks):
            there = rock.pose.inverse().apply(points.reshape(-1, 3))
            away = distances_from_rock(rock.hold, there, most).reshape(count, -1)
            near = np.minimum.reduceat(away, self._first, axis=1)
            # the place of a segment that is nearest to the rock is so far from one of its points
            inner = np.sqrt(np.maximum(near * near - gaps * gaps, 0.0))
            found[:, i] = np.where(near > gaps, inner, near - gaps) - radii
        return found

    def _on_way(self, progress: Array) -> list[Pose]:
        """Return the poses of B at some progress."""
        at = np.clip(progress.astype(int), 0, len(self._bodies) - 2).tolist()
        return [
            pose_between(self._bodies[i], self._bodies[i + 1], part)
            for i, part in zip(at, (progress - at).tolist(), strict=True)
        ]

    def motions(self, steps: Array) -> Array:
        """Return bounds of how much the distances change by steps (S, d), shape (S, P) [m]."""
        return np.asarray(np.abs(steps) @ self._levers.T)

    def nearest(self, posture: Array) -> NearestPair:
        """Return what is nearest to each other at a posture, shape (d,) [rad]."""
        distances = self.clearances(posture[None])[0]
        k = int(distances.argmin())
        return NearestPair(*self._named(k), float(distances[k]))

    def _named(self, column: int) -> tuple[str, str]:
        """Return the names of the two things whose distance a column has."""
        names, rest = self.scene.names, column - len(self._pairs)
        if rest < 0:
            i, j = self._pairs[column].tolist()
            return names[j], names[i]
        rock, capsule = np.argwhere(self._met)[rest].tolist()
        return names[int(self._measured[capsule])], self.scene.rocks[rock].name
