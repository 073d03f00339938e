"""Bound the load by what the hand's structure bears, whatever its spines hold (Sections 2, 3.2).

Three figures are printed: a finger sustains 500 N of shear, produces 600 N at its tip, and a hand
grips under loads of up to 50 kg. The last limits the whole force F that a hand *holds*, across the
rock and away from it,

    |(F_x, F_y, min(F_z, 0))| ≤ R,

but not how hard it presses. As rows of a wrench space that is a polyhedron inside of it: ``d_k · F
≤ R`` for the `HELD_DIRECTIONS` directions d_k, longer than unit vectors by the little that puts the
polyhedron's corners on the ball.
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
"""Directions (17, 3) in H whose largest product with a hand's force is at least what the hand
holds, and at most 1.12 times as much; 1.04 times straight along x or y."""


@dataclass(frozen=True)
class Structure:
    """Strengths of a finger and of a hand.

    Attributes
    ----------
    finger_shear : float
        Of the shears of a finger's tiles together, the base tile's too [N].
    fingertip_force : float
        Of the distal phalanx pressing on rock [N]. The paper's 600 N are what a finger *can
        produce* at its tip, and its shear has a figure of its own, so it is read as what the tip
        bears in pressing.
    hand_load : float
        R, of what a hand holds [N].
    """

    finger_shear: float
    fingertip_force: float
    hand_load: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> Structure:
        """Read the strengths from ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or not above zero.
        """
        numbers = {
            name: table.positive("structure", name)
            for name in ("finger_shear", "fingertip_force", "held_mass", "standard_gravity")
        }
        return cls(
            finger_shear=numbers["finger_shear"],
            fingertip_force=numbers["fingertip_force"],
            hand_load=numbers["held_mass"] * numbers["standard_gravity"],
        )
