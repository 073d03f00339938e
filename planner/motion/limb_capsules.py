"""Place the capsules of a limb and its hand at many joint angles in one call (kinematics)."""

from __future__ import annotations

import numpy as np

from hand_models.base import SKEW_MATRICES, Array, Pose
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
    steps : ndarray of int, shape (c,)
        Number of joints that move each capsule.
    levers : ndarray, shape (c, n)
        Upper bounds of how far a capsule's segment moves by a motion of each joint [m/rad], or [1].
    reaches : ndarray, shape (c,)
        Upper bounds of how far a segment is from B's origin [m].
    """

    def __init__(self, robot: Robot, limb: str) -> None:
        chain, model, capsules = robot.chains[limb], robot.model, robot.capsules
        own = [i for i, each in enumerate(capsules.limbs) if each == limb]
        palm, _ = palm_capsule(robot.hand)
        hand = model.frames[chain.frame].placement
        place = Pose(np.array(hand.translation), np.array(hand.rotation))
        self.steps = np.append(capsules.steps[own], len(chain.moving))
        self._ends = np.concatenate([capsules.ends[own], place.apply(palm)[None]])
        self._chain, placements = chain, [model.jointPlacements[i] for i in chain.ids]
        turns = np.array([each.rotation for each in placements])
        self._shifts = np.array([each.translation for each in placements])
        root = robot.root.inverse()
        self._shifts[0] = root.apply(self._shifts[0])
        turns[0] = root.rotation @ turns[0]
        motions = np.array([robot.data.joints[i].S.ravel() for i in chain.ids])
        self._slides = np.einsum("kxy,ky->kx", turns, motions[:, :3])
        # Rodrigues: 1 + sin(q) K + (1 − cos(q)) K², K the cross product with the axis
        across = np.einsum("kx,xij->kij", motions[:, 3:], SKEW_MATRICES)
        self._turns = np.stack([turns, turns @ across, turns @ across @ across])
        self.levers, self.reaches = self._bounds()

    def _bounds(self) -> tuple[Array, Array]:
        """Return levers and reaches, from the distances of joint to joint."""
        chain = self._chain
        slid = np.abs(self._slides).max(axis=1) > 0.0
        most = np.maximum(np.abs(chain.lower), np.abs(chain.upper))
        farthest = np.abs(chain.coupling) @ np.where(np.isfinite(most), most, 0.0)
        travel = np.where(slid, farthest + np.abs(chain.offset), 0.0)
        along = np.cumsum(np.linalg.norm(self._shifts, axis=1) + travel)
        ends = np.linalg.norm(self._ends, axis=2).max(axis=1)
        levers = np.zeros((len(ends), len(along)))
        for row, step, end in zip(levers, self.steps, ends, strict=True):
            row[:step] = along[step - 1] - along[:step] + end
        levers = np.where(slid, levers > 0.0, levers) @ np.abs(chain.coupling)
        return levers, along[self.steps - 1] + ends

    def segments(self, angles: Array) -> Array:
        """Return the segments of all capsules in B, shape (S, c, 2, 3) [m].

        Parameters
        ----------
        angles : ndarray, shape (S, n)
            Joint angles of S postures [rad].
        """
        q = angles @ self._chain.coupling.T + self._chain.offset
        sine, rest = np.sin(q)[:, :, None, None], 1.0 - np.cos(q)[:, :, None, None]
        turned = self._turns[0] + sine * self._turns[1] + rest * self._turns[2]
        shifted = self._shifts + q[:, :, None] * self._slides
        turns, places = np.empty_like(turned), np.empty_like(shifted)
        turns[:, 0], places[:, 0] = turned[:, 0], shifted[:, 0]
        for i in range(1, q.shape[1]):
            before = turns[:, i - 1]
            turns[:, i] = before @ turned[:, i]
            places[:, i] = places[:, i - 1] + (before @ shifted[:, i, :, None])[:, :, 0]
        last = self.steps - 1
        found: Array = self._ends @ turns[:, last].mT + places[:, last, None]
        return found
