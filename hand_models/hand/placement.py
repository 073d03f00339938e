"""Hands at their holds before closing: the rock under their fingers, base tiles and palm tiles."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, Pose
from hand_models.hand.finger_frames import STACK_ROWS
from hand_models.hand.grasp import Grasp
from hand_models.hand.model import HandModel
from hand_models.hand.seating import Seating
from hand_models.rock import Hold
from hand_models.sections import (
    FingerPlane,
    FingerRock,
    Section,
    Swept,
    alike_across,
    entry_distances,
)
from hand_models.tile import Surface

__all__ = ["PlacedHands", "Placement", "PlacementKey"]


class Placement(NamedTuple):
    """Hold, surface, grasp and pose with which one hand is to close.

    Attributes
    ----------
    hold : Hold
    surface : Surface
        Strength of a tile on the hold.
    grasp : Grasp
    hold_in_hand : Pose or None
        The hold's frame in the hand frame H; None to have the hand seated.
    at : Pose or None
        Frame on the hold, in the hold's frame, on which a hand without ``hold_in_hand`` is seated;
        None for the hold's own frame.
    """

    hold: Hold
    surface: Surface
    grasp: Grasp
    hold_in_hand: Pose | None
    at: Pose | None = None


class PlacementKey:
    """Hashable cache key of a placement: hands of equal keys close alike.

    Poses are compared by their bytes. The hash is computed once.
    """

    __slots__ = ("_hash", "_parts")

    def __init__(self, placement: Placement) -> None:
        hold, surface, grasp, *poses = placement
        self._parts: Hashable = hold, surface, grasp, *map(_digits, poses)
        self._hash = hash(self._parts)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PlacementKey) and self._parts == other._parts


def _digits(pose: Pose | None) -> Hashable:
    if pose is None:
        return None
    return tuple(np.asarray(part, dtype=float).tobytes() for part in (pose.position, pose.rotation))


class SmoothCuts(NamedTuple):
    """A smooth hold's shape, and how the fingers of a hand meet it.

    Attributes
    ----------
    shape : Swept
    keys : tuple of tuple
        Numbers that are equal for fingers that are mirror images of each other.
    sides : tuple of float
        1 or −1, different for two such fingers if one's left is the other's right.
    planes : sequence of FingerPlane or None
        Plane in which `cut_of` cuts what each finger meets with its tiles; None where that is not
        a cut. Planes are equal for fingers that are mirror images, so that each is cut once.
    alike : sequence of bool
        Whether the rock is alike across each finger.
    """

    shape: Swept
    keys: tuple[tuple[FingerPlane, tuple[float, float, float]], ...]
    sides: tuple[float, ...]
    planes: Sequence[FingerPlane | None]
    alike: Sequence[bool]


def _cut(
    origin: list[float], along: list[float], into: list[float], across: list[float]
) -> tuple[tuple[FingerPlane, tuple[float, float, float]], float]:
    """Return key and side of a finger, as of `SmoothCuts`, by its plane and the way across it."""
    (a, b, c), (d, e, f), (x, y, z), (u, v, w) = along, into, origin, across
    # every swept hold is its own mirror image in x and in y
    if (a or d or x) < 0.0:
        a, d, x, u = -a, -d, -x, -u
    if (b or e or y) < 0.0:
        b, e, y, v = -b, -e, -y, -v
    side = -1.0 if (u or v or w) < 0.0 else 1.0
    return ((a, b, c, d, e, f, x, y, z), (side * u, side * v, side * w)), side


def _nearest_plane(
    plane: FingerPlane, across: tuple[float, float, float], half: float
) -> FingerPlane | None:
    """Return the plane beside a finger's, at most so far, in which a ball comes nearest to it [m].

    None where the nearest places are in no such plane.
    """
    (a, b, c, d, e, f, *origin), (u, v, w) = plane, across
    x, y, z = origin
    square = u * u + v * v + w * w
    least = BASE_TOLERANCES.relative * square
    if max(abs(a * u + b * v + c * w), abs(d * u + e * v + f * w)) > least:
        return None
    far = min(max(-(x * u + y * v + z * w) / square, -half), half)
    return a, b, c, d, e, f, x + far * u, y + far * v, z + far * w


class PlacedHands:
    """n hands of one model at their holds, not yet closed.

    Parameters
    ----------
    hand : HandModel
    placements : sequence of Placement, length n
    seatings : sequence of Seating, length n
        Pose of each hold in its hand.

    Attributes
    ----------
    frames : FrameStack
        Finger frames and tiles of the hands, in the hand frame H.
    """

    def __init__(
        self,
        hand: HandModel,
        placements: Sequence[Placement],
        seatings: Sequence[Seating],
    ) -> None:
        self.hand = hand
        self.placements = placements
        self.seatings = seatings
        self._shapes = [each.hold.swept for each in placements]
        self.frames = hand.frame_stack(tuple([each.grasp.outer_rotation for each in placements]))
        # zeros stand for a hold that is not swept
        swept = np.array([shape or Swept(0.0, 0.0, 0.0, 0.0, 0.0) for shape in self._shapes])
        poses = [seating.pose for seating in seatings]
        rotations = np.concatenate([pose.rotation for pose in poses]).reshape(-1, 3, 3)
        positions = np.concatenate([pose.position for pose in poses]).reshape(-1, 1, 3)
        # from the centre of each hold's ball, in its axes
        there = np.empty((len(poses), 4, 3))
        there[:, :3], there[:, 3:] = rotations, -positions @ rotations
        there[:, 3, 2] -= swept[:, 3]
        # fingers that are alike but for rounding are alike: lengths in metres have 15 digits
        seen = (self.frames.rows @ there).round(15)
        self._seen: list[list[list[float]]] = (seen * swept[:, None, :3]).tolist()
        across, scales = (self.frames.across[:, :, 0] @ rotations).round(15), swept[:, None, :3]
        self._across: list[list[list[float]]] = (across * scales).tolist()
        self._alike: list[list[bool]] = alike_across(scales, across).tolist()

    def cuts(self, index: int) -> SmoothCuts | None:
        """Return a smooth hold's shape and the cuts through it of a hand; None on other rock.

        Parameters
        ----------
        index : int
            Index of the hand.
        """
        shape, rows = self._shapes[index], self._seen[index]
        if shape is None:
            return None
        alike, into = self._alike[index], rows[STACK_ROWS.into]
        found = [
            _cut(origin, along, into, across)
            for origin, along, across in zip(
                rows[STACK_ROWS.joints], rows[STACK_ROWS.alongs], self._across[index], strict=True
            )
        ]
        keys, sides = zip(*found, strict=True)
        half = 0.5 * self.hand.finger.tile_width
        planes = [
            plane if same else _nearest_plane(plane, across, half)
            for same, (plane, across) in zip(alike, keys, strict=True)
        ]
        return SmoothCuts(shape, keys, sides, planes, alike)

    def gaps(self) -> Array:
        """Return how far the tiles of each hand's bases, then of its palm, are from the rock [m].

        A row a hand; along z of the hand frame H, negative inside the rock, infinite without rock.
        """
        tiles, into = STACK_ROWS.tiles, STACK_ROWS.into
        return np.array(
            [
                self._gaps_on(i)
                if shape is None
                else entry_distances(shape, seen[tiles], seen[into])
                for i, (shape, seen) in enumerate(zip(self._shapes, self._seen, strict=True))
            ]
        )

    def _gaps_on(self, index: int) -> list[float]:
        """Return the gaps of one hand on rock that is not smooth."""
        there = self.seatings[index].pose.inverse()
        into = there.rotation[:, 2]
        hold = self.placements[index].hold
        places = there.apply(self.frames.rows[index, STACK_ROWS.tiles, :3])
        return hold.entries(places, into)

    def rock(self, index: int, finger: int) -> FingerRock:
        """Return the rock under the whole width of a finger; arguments as of `section`."""
        hand_in_hold = self.seatings[index].pose.inverse()
        return self.frames.hands[index][finger].rock(self.placements[index].hold, hand_in_hold)

    def section(self, index: int, finger: int) -> Section | None:
        """Return the rock in a finger's plane, in its coordinates F; None if there is none.

        Parameters
        ----------
        index : int
            Index of the hand.
        finger : int
            Index of the finger in `FINGERS`.

        Returns
        -------
        Section or None
            `Hold.raw_section` in a fingernail grasp, else the envelope of the rock across the
            width of the tiles.
        """
        hold, grasp = self.placements[index].hold, self.placements[index].grasp
        hand_in_hold = self.seatings[index].pose.inverse()
        frame = self.frames.hands[index][finger]
        return frame.cut(hold, hand_in_hold, raw=grasp.fingernail)
