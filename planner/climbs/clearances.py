"""Distances of limbs from each other, and of one limb from the rock, at many joint angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, InvalidInputError, Pose
from planner.motion import CollisionScene, JointSpace, Rock, capsule_distances, rocks_of
from planner.prepare import settle_each
from planner.robots import scene_number
from planner.search import Wall

__all__ = ["Clearances"]


class Clearances:
    """Clearances of a robot's limbs before a wall.

    Parameters
    ----------
    wall : Wall
        Of one rock, or of a rock for each placement.
    """

    def __init__(self, wall: Wall) -> None:
        self._names, rocks = wall.robot.limbs, list[Rock]()
        for each in wall.places:
            if each.hold_in_hand is not None and each.hold is not None:
                pose = each.pose @ each.hold_in_hand
                rocks = [Rock("the rock", each.hold, pose, frozenset(self._names))]
                break
        if not rocks:
            settled = zip(wall.places, settle_each(wall.robot.hand, wall.places), strict=True)
            closed = [(hand, at) for hand, at in settled if not isinstance(at, InvalidInputError)]
            every = frozenset(self._names)
            rocks = [rock._replace(limbs=every) for rock in rocks_of(closed)]
        self._scene = CollisionScene(wall.robot, rocks)
        self._least = scene_number("motion", "margin_at_hold")
        self._swings = scene_number("motion", "margin")
        self._pairs = dict[tuple[int, int], tuple[Indices, Indices]]()

    def apart(
        self, limbs: tuple[int, int], first: Array, second: Array, *, swings: bool = False
    ) -> NDArray[np.bool_]:
        """Return which joint angles of two limbs keep them apart.

        Parameters
        ----------
        limbs : tuple of (int, int)
        first, second : ndarray, shapes (k, n), (m, n)
            Joint angles of the one and the other [rad].
        swings : bool
            Whether the first one swings, with the margin of swings.

        Returns
        -------
        ndarray of bool, shape (k, m)
        """
        scene = self._scene
        own, pairs = self._pairs_of(limbs)
        segments = [
            scene.limbs[self._names[limb]].segments(angles)
            for limb, angles in zip(limbs, (first, second), strict=True)
        ]
        i, j = np.indices((len(first), len(second))).reshape(2, -1)
        both = np.ascontiguousarray(np.hstack([segments[0][i], segments[1][j]]))
        margin = self._swings if swings else self._least
        gaps = capsule_distances(both, scene.radii[own], pairs, 2.0 * margin)
        clear = gaps.min(axis=1, initial=np.inf) >= margin
        return np.asarray(clear.reshape(len(first), len(second)))

    def of_rock(self, limb: int, bodies: Sequence[Pose], angles: Array, *, holds: bool) -> bool:
        """Return whether a limb is clear of the rock, of the body and of itself.

        Parameters
        ----------
        limb : int
        bodies : sequence of Pose, length m
            Poses of B in W.
        angles : ndarray, shape (m, n)
            Joint angles at each [rad].
        holds : bool
            Whether the hand is on the rock, and may touch it.
        """
        name = self._names[limb]
        touching = (name,) if holds else ()
        margin = self._least if holds else self._swings
        space = JointSpace(self._scene, bodies, {name: angles[0]}, (name,), touching=touching)
        postures = angles
        if len(bodies) > 1:
            postures = np.column_stack([angles, np.arange(float(len(bodies)))])
        return bool(space.clearances(postures, margin).min() >= margin)

    def _pairs_of(self, limbs: tuple[int, int]) -> tuple[Indices, Indices]:
        """Return the capsules of two limbs, and the pairs of them that may meet."""
        if limbs not in self._pairs:
            scene = self._scene
            own = [scene.own[self._names[limb]] for limb in limbs]
            mine = np.concatenate(own)
            inside = [np.isin(scene.pairs, each) for each in own]
            between = (inside[0] | inside[1]).all(axis=1) & inside[0].any(1) & inside[1].any(1)
            order = np.argsort(mine)
            pairs = order[np.searchsorted(mine[order], scene.pairs[between])].reshape(-1, 2)
            self._pairs[limbs] = mine, pairs
        return self._pairs[limbs]
