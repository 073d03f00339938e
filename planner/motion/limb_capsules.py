"""Place the capsules of a limb and its hand at many joint angles in one call (kinematics)."""

from __future__ import annotations

import numpy as np

from hand_models.base import Array, Pose, turns_about
from planner.motion.settings import MOTION_SETTINGS
from planner.robots import Robot
from planner.scene import palm_capsule

__all__ = ["LimbCapsules"]


class LimbCapsules:
    """The c capsules that a limb of k joints moves, n of them by motors; the hand's is the last.

    Parameters
    ----------
    robot : Robot
    limb : str

    Attributes
    ----------
    names : tuple of str, length c
    steps : ndarray of int, shape (c,)
        Number of joints that move each capsule.
    radii : ndarray, shape (c,)
        Radii [m].
    levers : ndarray, shape (c, n)
        Upper bounds of how far a capsule's points move by a motion of each joint [m/rad], or [1].
    points_at : ndarray of int, shape (c,)
        Index of the first of each capsule's points (`points`).
    gaps : ndarray, shape (c,)
        Half the distance of its neighbouring points [m].
    """

    def __init__(self, robot: Robot, limb: str) -> None:
        chain, model, capsules = robot.chains[limb], robot.model, robot.capsules
        own = [i for i, each in enumerate(capsules.limbs) if each == limb]
        palm, radius = palm_capsule(robot.hand)
        hand = model.frames[chain.frame].placement
        place = Pose(np.array(hand.translation), np.array(hand.rotation))
        self.names = (*(capsules.names[i] for i in own), f"hand of {limb}")
        self.steps = np.append(capsules.steps[own], len(chain.moving))
        self.radii = np.append(capsules.radii[own], radius)
        self._ends = np.concatenate([capsules.ends[own], place.apply(palm)[None]])
        self._chain, placements = chain, [model.jointPlacements[i] for i in chain.ids]
        self._turns = np.array([each.rotation for each in placements])
        self._shifts = np.array([each.translation for each in placements])
        root = robot.root.inverse()
        self._shifts[0] = root.apply(self._shifts[0])
        self._turns[0] = root.rotation @ self._turns[0]
        motions = np.array([robot.data.joints[i].S.ravel() for i in chain.ids])
        self._slides, self._axes = motions[:, :3], motions[:, 3:]
        self.levers = self._bounds()
        spread, along = MOTION_SETTINGS.point_spacing, self._ends[:, 1] - self._ends[:, 0]
        lengths = np.linalg.norm(along, axis=1)
        counts = np.ceil(lengths / spread).astype(int) + 1
        self.points_at = np.cumsum([0, *counts[:-1]])
        self.gaps = 0.5 * lengths / np.maximum(counts - 1, 1)
        parts = [np.linspace(0.0, 1.0, count)[:, None] for count in counts]
        middles = np.repeat(counts == 1, counts)[:, None]
        self._whose = np.repeat(np.arange(len(counts)), counts)
        self._parts = np.where(middles, 0.5, np.concatenate(parts))

    def _bounds(self) -> Array:
        """Return the levers, from the distances of joint to joint."""
        chain = self._chain
        k, ends = len(chain.moving), np.linalg.norm(self._ends, axis=2).max(axis=1)
        slid = np.abs(self._slides).max(axis=1) > 0.0
        most = np.maximum(np.abs(chain.lower), np.abs(chain.upper))
        travel = np.where(
            slid, np.abs(chain.coupling) @ np.where(np.isfinite(most), most, 0.0), 0.0
        )
        travel += np.where(slid, np.abs(chain.offset), 0.0)
        longest = np.linalg.norm(self._shifts, axis=1) + travel
        along = np.cumsum(longest)
        found = np.zeros((len(ends), k))
        for row, step, end in zip(found, self.steps, ends, strict=True):
            row[:step] = along[step - 1] - along[:step] + end
        return np.where(slid, found > 0.0, found) @ np.abs(chain.coupling)

    def joints(self, angles: Array) -> tuple[Array, Array]:
        """Return the axes (S, k, 3, 3) and origins (S, k, 3) in B of all joints [m].

        Parameters
        ----------
        angles : ndarray, shape (S, n)
            Joint angles [rad].
        """
        q = angles @ self._chain.coupling.T + self._chain.offset
        turned = self._turns @ turns_about(q[:, :, None] * self._axes)
        shifted = self._shifts + np.einsum(
            "kxy,sky->skx", self._turns, q[:, :, None] * self._slides
        )
        turns, places = np.empty_like(turned), np.empty_like(shifted)
        turns[:, 0], places[:, 0] = turned[:, 0], shifted[:, 0]
        for i in range(1, q.shape[1]):
            before = turns[:, i - 1]
            turns[:, i] = before @ turned[:, i]
            places[:, i] = places[:, i - 1] + (before @ shifted[:, i, :, None])[:, :, 0]
        return turns, places

    def segments(self, angles: Array) -> Array:
        """Return the segments of all capsules in B, shape (S, c, 2, 3) [m]."""
        turns, places = self.joints(angles)
        last = self.steps - 1
        turned: Array = self._ends @ turns[:, last].mT
        return turned + places[:, last, None]

    def points(self, segments: Array) -> Array:
        """Return points along all capsules, shape (S, p, 3) [m]: those of the first one first."""
        first, second = segments[:, self._whose, 0], segments[:, self._whose, 1]
        return np.asarray(first + self._parts * (second - first))
