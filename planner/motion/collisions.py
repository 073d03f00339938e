"""Clearance of a robot's links and hands from each other and from rock, at many postures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Pose
from planner.motion.compiled_capsules import capsule_distances
from planner.motion.limb_capsules import LimbCapsules
from planner.motion.rocks import Rock, rock_distances
from planner.motion.settings import MOTION_SETTINGS
from planner.robots import Robot
from planner.scene import palm_capsule, unjoined_pairs

__all__ = ["CollisionScene", "JointSpace", "Nearest"]


class Nearest(NamedTuple):
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
    """A robot with its hands, as capsules, and the rock about it.

    Parameters
    ----------
    robot : Robot
    rocks : sequence of Rock
        All holds of a climb that limbs can meet.

    Attributes
    ----------
    robot, rocks
        The parameters.
    names : tuple of str, length N
        Of each capsule: the robot's (`Robot.capsules`), then the hands'.
    owners : tuple of str or None, length N
        Limb of each capsule; None for the body's.
    radii : ndarray, shape (N,)
        Radii of the capsules [m].
    pairs : ndarray of int, shape (k, 2)
        Capsules that may meet.
    """

    def __init__(self, robot: Robot, rocks: Sequence[Rock]) -> None:
        self.robot, self.rocks = robot, tuple(rocks)
        capsules, limbs = robot.capsules, robot.limbs
        _, palm = palm_capsule(robot.hand)
        self.owners = (*capsules.limbs, *limbs)
        named = zip(capsules.names, capsules.limbs, strict=True)
        names = ["body" if limb is None else name for name, limb in named]
        self.names = (*names, *(f"hand of {limb}" for limb in limbs))
        self.radii = np.append(capsules.radii, np.full(len(limbs), palm))
        self.pairs = unjoined_pairs(robot, limbs, self.radii)
        self.limbs = {limb: LimbCapsules(robot, limb) for limb in limbs}
        self._body, _ = robot.body_capsules
        self.columns = {
            limb: np.flatnonzero([owner == limb for owner in self.owners]) for limb in limbs
        }

    def placed(self, joints: Mapping[str, Array], count: int = 1) -> Array:
        """Return the segments of all capsules in B at S postures, shape (S, N, 2, 3) [m].

        Parameters
        ----------
        joints : mapping of str to ndarray, shape (n,) or (S, n)
            Angles of each limb's joints [rad]; those of a limb left out are its rest angles.
        count : int
            S.
        """
        found = np.empty((count, len(self.radii), 2, 3))
        found[:, : len(self._body)] = self._body
        for limb, capsules in self.limbs.items():
            angles = np.atleast_2d(joints.get(limb, self.robot.chains[limb].rest))
            found[:, self.columns[limb]] = capsules.segments(angles)
        return found

    def nearest(self, body: Pose, joints: Mapping[str, Array]) -> Nearest:
        """Return what is nearest to each other at one posture, with all hands on their rock.

        A hand, with the links that its limb's last joint moves, may touch rock.

        Parameters
        ----------
        body : Pose
            Pose of B in W.
        joints : mapping of str to ndarray, shape (n,)
            Angles of each limb's joints [rad]; those of a limb left out are its rest angles.
        """
        whole = JointSpace(self, body, joints, self.robot.limbs, touching=self.robot.limbs)
        return whole.nearest(whole.start)


class JointSpace:
    """Clearances over the joint angles of some limbs; all others, and the body, stay.

    A posture x, shape (d,), has the angles of these limbs one after the other. With ``body_to`` the
    body moves, too: x ends with its progress from 0 to 1, position along a straight line and
    orientation along the shortest turn; then everything is measured.

    Parameters
    ----------
    scene : CollisionScene
    body : Pose
        Pose of B in W.
    joints : mapping of str to ndarray, shape (n,)
        Angles of each limb's joints [rad]; those of a limb left out are its rest angles.
    limbs : sequence of str
        Limbs that move.
    touching : collection of str
        Limbs whose hand holds rock: with the links that the last joint moves, it is not measured
        from its own (`Rock.limbs`) and from what else it touches at the start.

    Attributes
    ----------
    start, lower, upper : ndarray, shape (d,)
        Posture that ``joints`` gives, and the limits of the angles [rad].
    """

    def __init__(
        self,
        scene: CollisionScene,
        body: Pose,
        joints: Mapping[str, Array],
        limbs: Sequence[str],
        *,
        touching: Collection[str],
    ) -> None:
        self.scene, self.limbs = scene, tuple(limbs)
        chains = [scene.robot.chains[limb] for limb in limbs]
        self.start = np.concatenate(
            [joints.get(limb, chain.rest) for limb, chain in zip(limbs, chains, strict=True)]
        )
        self.lower = np.concatenate([chain.lower for chain in chains])
        self.upper = np.concatenate([chain.upper for chain in chains])
        ends = np.cumsum([0, *(len(chain.joints) for chain in chains)])
        self._parts = [slice(a, b) for a, b in pairwise(ends.tolist())]
        self._still = scene.placed(joints)
        self._in_rocks = [rock.pose.inverse() @ body for rock in scene.rocks]
        moves = np.zeros(len(scene.radii), dtype=bool)
        for limb in limbs:
            moves[scene.columns[limb]] = True
        self._pairs = scene.pairs[moves[scene.pairs].any(axis=1)]
        self._met = self._meets(touching)
        self._levers = self._bounds()

    def _meets(self, touching: Collection[str]) -> NDArray[np.bool_]:
        """Return which of the moving limbs' capsules are measured from which rock."""
        found = []
        for limb, part in zip(self.limbs, self._parts, strict=True):
            capsules, rocks = self.scene.limbs[limb], self.scene.rocks
            measured = np.ones((len(rocks), len(capsules.steps)), dtype=bool)
            if limb in touching:
                points = capsules.points(capsules.segments(self.start[None, part]))[0]
                palm = points[capsules.points_at[-1] :]
                for row, rock, seen in zip(measured, rocks, self._in_rocks, strict=True):
                    away = rock_distances(rock.hold, seen.apply(palm)).min() - capsules.radii[-1]
                    if limb in rock.limbs or away < MOTION_SETTINGS.touch:
                        row[capsules.steps == capsules.steps[-1]] = False
            found.append(measured)
        return np.concatenate(found, axis=1)

    def _bounds(self) -> Array:
        """Return how fast the distances of all columns change at most, shape (P, d)."""
        every = np.zeros((len(self.scene.radii), len(self.start)))
        steps = np.zeros(len(every), dtype=int)
        whose = np.full(len(every), -1)
        for i, (limb, part) in enumerate(zip(self.limbs, self._parts, strict=True)):
            at = self.scene.columns[limb]
            every[at, part] = self.scene.limbs[limb].levers
            steps[at], whose[at] = self.scene.limbs[limb].steps, i
        first, second = self._pairs.T
        apart = every[first] + every[second]
        # of two capsules of one limb only the joints between them matter
        own = np.flatnonzero((whose[first] == whose[second]) & (whose[first] >= 0))
        outer = np.where(steps[first] > steps[second], first, second)
        inner = np.where(steps[first] > steps[second], second, first)
        for k in own.tolist():
            coupling = self.scene.robot.chains[self.limbs[whose[outer[k]]]].coupling
            between = (np.abs(coupling[steps[inner[k]] : steps[outer[k]]]) > 0.0).any(axis=0)
            part = self._parts[whose[outer[k]]]
            apart[k] = 0.0
            apart[k, part] = every[outer[k], part] * between
        moving = np.concatenate([self.scene.columns[limb] for limb in self.limbs])
        rows = [every[moving[met]] for met in self._met]
        return np.concatenate([apart, *rows])

    def clearances(self, postures: Array) -> Array:
        """Return the distances of all pairs that may meet, shape (S, P) [m].

        First of capsules, then of each rock's. They are lower bounds, exact near contact but for
        the spacing of points along a capsule.

        Parameters
        ----------
        postures : ndarray, shape (S, d)
            Joint angles of the moving limbs [rad].
        """
        scene, count = self.scene, len(postures)
        placed = np.repeat(self._still, count, axis=0)
        points, gaps, radii, at, total = [], [], [], [], 0
        for limb, part in zip(self.limbs, self._parts, strict=True):
            capsules = scene.limbs[limb]
            segments = capsules.segments(postures[:, part])
            placed[:, scene.columns[limb]] = segments
            points.append(capsules.points(segments))
            gaps.append(capsules.gaps)
            radii.append(capsules.radii)
            at.append(capsules.points_at + total)
            total += points[-1].shape[1]
        far = MOTION_SETTINGS.farthest
        found = [capsule_distances(placed, scene.radii, self._pairs, far)]
        where, gap = np.concatenate(points, axis=1), np.concatenate(gaps)
        radius, first = np.concatenate(radii), np.concatenate(at)
        for rock, seen, met in zip(scene.rocks, self._in_rocks, self._met, strict=True):
            there = seen.apply(where.reshape(-1, 3))
            away = rock_distances(rock.hold, there).reshape(count, total)
            near = np.minimum.reduceat(away, first, axis=1)
            # the nearest place of a segment is at most so far from one of its points
            square = near * near - gap * gap
            near = np.where(near > gap, np.sqrt(np.maximum(square, 0.0)), near - gap)
            found.append((near - radius)[:, met])
        return np.concatenate(found, axis=1)

    def motions(self, steps: Array) -> Array:
        """Return bounds of how much the distances change by steps (S, d), shape (S, P) [m]."""
        return np.asarray(np.abs(steps) @ self._levers.T)

    def nearest(self, posture: Array) -> Nearest:
        """Return what is nearest to each other at a posture, shape (d,) [rad]."""
        distances = self.clearances(posture[None])[0]
        k = int(distances.argmin())
        return Nearest(*self._named(k), float(distances[k]))

    def _named(self, column: int) -> tuple[str, str]:
        """Return the names of the two things whose distance a column has."""
        names, rest = self.scene.names, column - len(self._pairs)
        if rest < 0:
            i, j = self._pairs[column].tolist()
            return names[j], names[i]
        moving = np.concatenate([self.scene.columns[limb] for limb in self.limbs])
        rock, capsule = np.argwhere(self._met)[rest].tolist()
        return names[int(moving[capsule])], self.scene.rocks[rock].name
