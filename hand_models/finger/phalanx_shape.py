"""Shape of the phalanges that meet rock, and how joint angles place them in a finger's plane.

A phalanx is a bar of circular section about its *axis*: straight under the tile, lifted so that
the tile's face is flat at its height, and from the tile's far end on down to the next joint. So
the tile is flat, its corners are round, and the phalanx ends in a disc about the next joint, with
the frame's radius.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, record_of
from hand_models.finger.model import FingerModel
from hand_models.sections import Complexes

__all__ = ["PhalanxShape", "fan_out", "middle_of_bed"]

Pressed = TypeVar("Pressed", float, NDArray[Any])


class PhalanxShape(NamedTuple):
    """Dimensions of a phalanx that meets rock, measured from its joint [m].

    Attributes
    ----------
    near, far : float
        Begin and end of the tile's face along the phalanx.
    end : float
        End of the phalanx: distance to the next joint.
    lift : float
        Height of the bar's axis under the tile, above the line of the joints.
    radius : float
        Radius of the bar.
    travel : float
        Distance that spines reach out of the tile.
    exponent : float
        Exponent of the law of engagement (`engaged_share`) [1].
    """

    near: float
    far: float
    end: float
    lift: float
    radius: float
    travel: float
    exponent: float

    @classmethod
    def of(cls, model: FingerModel) -> PhalanxShape:
        """Return the shape of the phalanges of a finger model."""
        radius = min(model.frame_radius, model.tile_height)
        lift = model.tile_height - radius
        spines = model.spine_travel, model.engagement_exponent
        return cls(*model.tile_range, model.joint_spacing, lift, radius, *spines)

    @property
    def length(self) -> float:
        """Length of the tile [m]."""
        return self.far - self.near

    @property
    def spacing(self) -> float:
        """Largest spacing of the points that represent rock [m]."""
        # so near that the round end of a phalanx slides over points as over the rock between
        return self.length / 192

    @property
    def fine(self) -> float:
        """Smoothing length of the gap [m].

        The gap differs from the least distance to the rock by about this length at most.
        """
        return self.length / 4800.0

    @property
    def closes(self) -> float:
        """Tolerance on negative gaps: rock inside a phalanx by less counts as touching [m]."""
        return self.length / 2.4e6

    @property
    def record(self) -> NDArray[np.void]:
        """Dimensions and the lengths derived from them, an array of one record [m]."""
        more = {"length": self.length, "fine": self.fine, "closes": self.closes}
        return record_of({**self._asdict(), **more})


def middle_of_bed(
    reaches: Iterable[Pressed], bends: Iterable[float | Pressed], depth: float | Pressed
) -> Pressed:
    """Return the offset from a face's first touch to its bed's centre of pressure [m].

    The offset is positive toward the face's end. The rock is a parabola on either side of the
    touch; the tile's end may cut the pressed part short.

    Parameters
    ----------
    reaches : pair of float or of ndarray
        Length of the pressed part toward the beginning of the face, and toward its end [m].
    bends : pair of float
        Curvature of the rock on either side [1/m].
    depth : float
        Depth to which the bed is pressed in at the touch [m].
    """
    load: Any = 0.0
    moment: Any = 0.0
    for side, reach, bend in zip((-1.0, 1.0), reaches, bends, strict=True):
        square = reach * reach
        load = load + reach * (depth - bend / 6.0 * square)
        moment = moment + square * (side * depth / 2.0 - side * bend / 8.0 * square)
    found: Pressed = moment / load
    return found


def fan_out(q: Array, spacing: float) -> tuple[Complexes, Complexes]:
    """Return the joints and directions of phalanges for joint angles (forward kinematics).

    Parameters
    ----------
    q : ndarray, shape (..., 3)
        Joint angles, each relative to the phalanx before it [rad].
    spacing : float
        Distance between joints [m].

    Returns
    -------
    joints, directions : ndarray of complex, shape (..., 3)
        x + i z of each joint in the finger frame F, the first at the origin [m]; unit vector along
        each phalanx.
    """
    u = np.exp(1j * np.cumsum(q, axis=-1))
    joints = np.zeros(u.shape, dtype=complex)
    joints[..., 1:] = spacing * np.cumsum(u[..., :-1], axis=-1)
    return joints, u
