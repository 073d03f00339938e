"""Hands at their holds before they close: what is under their fingers and their flat tiles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from hand_models.finger_frames import ALONG, INTO, JOINTS, PLACES, TILES
from hand_models.frames import Array, Pose
from hand_models.grasp import Grasp
from hand_models.holds import Hold
from hand_models.seating import Seating
from hand_models.sections import Section
from hand_models.settled_hand import FINGERS
from hand_models.spines import Surface
from hand_models.swept import Swept, entries
from hand_models.swept_cuts import Plane

if TYPE_CHECKING:
    from hand_models.hand import SpinyHand

__all__ = ["CutKey", "PlacedHands", "Placement"]

CutKey = tuple[Swept, Plane]
"""A hold and the plane that cuts it; arguments of `cut_of`."""

DIGITS: Final = 15
"""Of lengths in metres, and of directions, that count."""

NOTHING: Final = Swept(0.0, 0.0, 0.0, 0.0, 0.0)
"""In place of a hold that is not swept."""


class Placement(NamedTuple):
    """What a hand is to close on, and how.

    Attributes
    ----------
    hold : Hold
    surface : Surface
        What a tile holds on it.
    grasp : Grasp
    hold_in_hand : Pose or None
        The hold's frame in H; None if the hand is to be seated.
    """

    hold: Hold
    surface: Surface
    grasp: Grasp
    hold_in_hand: Pose | None


class PlacedHands:
    """Hands of one kind at their holds.

    Parameters
    ----------
    hand : SpinyHand
    placements : sequence of Placement, length n
    seatings : sequence of Seating, length n
        Where their holds are.

    Attributes
    ----------
    frames : FrameStack
        Of the hands.
    seatings : list of Seating
        As given, with copies of the poses that nobody can change.
    """

    def __init__(
        self, hand: SpinyHand, placements: Sequence[Placement], seatings: Sequence[Seating]
    ) -> None:
        self.hand = hand
        self.placements = placements
        self.frames = hand.frame_stack(tuple([each.grasp.outer_rotation for each in placements]))
        positions = np.array([seating.pose.position for seating in seatings], dtype=float)
        rotations = np.array([seating.pose.rotation for seating in seatings], dtype=float)
        positions.setflags(write=False)
        rotations.setflags(write=False)
        self.seatings = [
            Seating(Pose(position, rotation), seating.rule)
            for position, rotation, seating in zip(positions, rotations, seatings, strict=True)
        ]
        self._swept = [each.hold.swept for each in placements]
        self._shapes = np.array([shape or NOTHING for shape in self._swept])
        # from the centre of each hold's ball, in its axes and scaled
        rows = self.frames.rows.copy()
        rows[:, PLACES] -= positions[:, None]
        rows = rows @ rotations
        rows[:, PLACES, 2] -= self._shapes[:, 3:4]
        # fingers that are alike but for rounding are alike
        self._rows = rows.round(DIGITS) * self._shapes[:, None, :3]

    def cut_key(self, index: int, finger: int) -> CutKey | None:
        """Return what the rock in the plane of a finger depends on; None if it is not smooth.

        Equal for fingers that are mirror images of one another.
        """
        shape = self._swept[index]
        if shape is None:
            return None
        along, into, origin = self._planes[index][finger]
        (a, b, c), (d, e, f), (x, y, z) = along, into, origin
        # every swept hold is its own mirror image in x and in y
        if (a or d or x) < 0.0:
            a, d, x = -a, -d, -x
        if (b or e or y) < 0.0:
            b, e, y = -b, -e, -y
        return shape, (a, b, c, d, e, f, x, y, z)

    @cached_property
    def _planes(self) -> list[list[list[list[float]]]]:
        """Axes and origin of each finger's plane."""
        planes = np.empty((len(self._rows), len(FINGERS), 3, 3))
        planes[:, :, 0] = self._rows[:, ALONG]
        planes[:, :, 1] = self._rows[:, INTO, None]
        planes[:, :, 2] = self._rows[:, JOINTS]
        return planes.tolist()  # type: ignore[no-any-return]

    @cached_property
    def gaps(self) -> Array:
        """From the base tiles and the palm's tiles to the rock along z of H, (n, 2 + t) [m].

        Infinite where there is none.
        """
        gaps = entries(self._shapes, self._rows[:, TILES], self._rows[:, INTO])
        for i, shape in enumerate(self._swept):
            if shape is None:
                there = self.seatings[i].pose.inverse()
                into = there.rotation[:, 2]
                hold = self.placements[i].hold
                places = there.apply(self.frames.rows[i, TILES])
                gaps[i] = [hold.entry(place, into) for place in places]
        return gaps

    def section(self, index: int, finger: int) -> Section | None:
        """Return the rock in the plane of a finger of one hand; raw under one that clings."""
        hold, grasp = self.placements[index].hold, self.placements[index].grasp
        hand_in_hold = self.seatings[index].pose.inverse()
        frame = self.frames.hands[index].fingers[finger]
        return frame.cut(hold, hand_in_hold, raw=grasp.fingernail)
