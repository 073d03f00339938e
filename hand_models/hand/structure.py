"""Bounds on load from the strength of the hand's structure, not of its spines (Sections 2, 3.2).

The paper prints three figures: a finger sustains 500 N of shear, produces 600 N at its tip, and a
hand grips under loads of up to 50 kg. What twist a finger bears about its axis is not printed. The
50 kg limit the force F that a hand exerts on the rock, across the rock and away from it,

    |(F_x, F_y, min(F_z, 0))| ≤ R,

but not how hard the hand presses. As rows of a wrench space that ball is a polyhedron inside it:
``d_k · F ≤ R`` for the `HELD_DIRECTIONS` d_k, longer than unit vectors just so that the
polyhedron's corners are on the ball.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.parameters import ParameterTable

__all__ = ["HELD_DIRECTIONS", "Structure"]


def _held() -> Array:
    """Return the directions d_k: 8 across the rock, 8 between these and away from it, 1 away.

    Every corner lies where three caps about the directions meet: two of the ring across and one of
    the ring below, one and two, or two of the ring below and the pole. The farthest of these from
    its three directions, and the angle between neighbours across, give how much to lengthen.
    """
    turn = np.arange(8) * math.pi / 4.0
    half = turn + math.pi / 8.0
    elevation = math.radians(40.7)  # at which the polyhedron is closest to the ball
    c, s, near = math.cos(elevation), math.sin(elevation), math.cos(math.pi / 8.0)
    across = np.column_stack([np.cos(half), np.sin(half), np.zeros(8)])
    below = np.column_stack([c * np.cos(turn), c * np.sin(turn), np.full(8, -s)])
    corners = (
        math.cos(math.atan2(near - c, s)) * near,
        math.cos(math.atan2(1.0 - c * near, s)),
        math.sin(math.atan2(c * near, 1.0 - s)),
        near,
    )
    return np.vstack([across, below, [[0.0, 0.0, -1.0]]]) / min(corners)


HELD_DIRECTIONS: Final = _held()
"""Directions d_k of the rows that bound a hand's force F, in the hand frame H, shape (17, 3).
The largest d_k · F is at least the length of (F_x, F_y, min(F_z, 0)), and at most 1.12 times as
much (1.04 times straight along x or y)."""


@dataclass(frozen=True)
class Structure:
    """Structural strengths of a finger and of a hand.

    Attributes
    ----------
    finger_shear : float
        Largest sum of the shears of a finger's tiles, the base tile's included [N].
    fingertip_force : float
        Largest force with which the distal phalanx may press on rock [N]. The paper's 600 N are
        what a finger *can produce* at its tip, read here as a limit on pressing.
    finger_twist : float
        Largest moment that a joint carries about the axis of its phalanx from tiles that bear
        beside the finger's plane [N·m].
    hand_load : float
        R, largest force of a hand across the rock and away from it [N].
    """

    finger_shear: float
    fingertip_force: float
    finger_twist: float
    hand_load: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> Structure:
        """Read the strengths from a table of ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or not above zero.
        """
        names = ("finger_shear", "fingertip_force", "finger_twist", "held_mass", "standard_gravity")
        numbers = {name: table.positive("structure", name) for name in names}
        return cls(
            finger_shear=numbers["finger_shear"],
            fingertip_force=numbers["fingertip_force"],
            finger_twist=numbers["finger_twist"],
            hand_load=numbers["held_mass"] * numbers["standard_gravity"],
        )
