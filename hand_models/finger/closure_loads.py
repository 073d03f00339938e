"""What its tendon loads a finger with that rests on all its phalanges.

The equations of `hand_models.finger.model` with every joint free: the distal one's holds the distal
normal load alone, the middle one's that and its own, and so on, so that they are solved from the
tip back.

What is affine in the tendon's tension is one complex number here: a + i b is a at zero tension [N],
and b per newton.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from hand_models.finger.model import FingerModel
from hand_models.finger.sequential_closure import ClosedPhalanx
from hand_models.tile import Surface

__all__ = ["ClosureLoads", "TendonLoads", "stays"]


class ClosureLoads(NamedTuple):
    """Loads of a finger's phalanges, proximal first, affine in its tension."""

    shears: tuple[complex, complex, complex]
    normals: tuple[complex, complex, complex]


class _Drawn(NamedTuple):
    """How a tendon draws a phalanx.

    Attributes
    ----------
    engaged : float
        Shear of its tile per newton of closing tension.
    gain : float
        Shear per newton of tension.
    stiffness, preload : float
        Of its joint's spring [N·m/rad, N·m].
    radius : float
        Torque on its joint per newton of tension [m].
    """

    engaged: float
    gain: float
    stiffness: float
    preload: float
    radius: float

    def shear(self, closing: float) -> complex:
        """Return what its tile is dragged with."""
        return complex(self.engaged * closing, self.gain)

    def torque(self, turn: float) -> complex:
        """Return the torque of spring and tendon on its joint, turned by an angle [N·m, m]."""
        return complex(-self.stiffness * turn - self.preload, self.radius)


class TendonLoads:
    """What tendons load fingers of one model with.

    Parameters
    ----------
    model : FingerModel
    """

    def __init__(self, model: FingerModel) -> None:
        self._height, gain = model.tile_height, model.shear_gain
        self._drawn = [
            [
                _Drawn(loss * (engagement - gain), loss * gain, stiffness, preload, loss * radius)
                for loss, engagement, stiffness, preload, radius in zip(
                    model.losses(base_tile).tolist(),
                    model.engagement,
                    model.joint_stiffness,
                    model.joint_preload,
                    model.pulley_radii,
                    strict=True,
                )
            ]
            for base_tile in (False, True)
        ]

    def loads(
        self, laid: Sequence[ClosedPhalanx], closing: float, base_tile: bool
    ) -> ClosureLoads | None:
        """Return the loads of a finger; None if its contacts cannot hold it.

        Parameters
        ----------
        laid : sequence of ClosedPhalanx
            All its phalanges.
        closing : float
            Tension at which the tiles caught the rock [N].
        base_tile : bool
            Whether a base tile comes first on the tendon.
        """
        first, second, third = self._drawn[base_tile]
        (angle_0, _, q_0, c_0, _), (angle_1, u_1, q_1, c_1, _), (angle_2, u_2, q_2, c_2, _) = laid
        if not min(c_0, c_1, c_2) > 0.0:
            return None
        s_0, s_1, s_2 = (each.shear(closing) for each in (first, second, third))
        # from earlier joints to later contacts, along and across the contacts' phalanges; from a
        # phalanx's own joint that is (c, h)
        h = self._height
        back = u_2.conjugate()
        point = q_2 + complex(c_2, h) * u_2
        d_12, d_02 = (point - q_1) * back, (point - q_0) * back
        d_01 = (q_1 + complex(c_1, h) * u_1 - q_0) * u_1.conjugate()
        n_2 = (third.torque(angle_2 - angle_1) - h * s_2) / c_2
        left = second.torque(angle_1 - angle_0) - h * s_1 - d_12.imag * s_2
        n_1 = (left - d_12.real * n_2) / c_1
        left = first.torque(angle_0) - h * s_0 - d_01.imag * s_1 - d_02.imag * s_2
        n_0 = (left - d_01.real * n_1 - d_02.real * n_2) / c_0
        return ClosureLoads((s_0, s_1, s_2), (n_0, n_1, n_2))


def stays(loads: ClosureLoads, surface: Surface, tension: float) -> bool:
    """Whether no contact of a finger breaks at a tension."""
    for t, n in zip(*loads, strict=True):
        normal = n.real + n.imag * tension
        if normal >= 0.0:
            continue
        shear = t.real + t.imag * tension
        if shear < 0.0:
            return False
        # a tile that slips under shear keeps its contact
        if shear > surface.shear_limit:
            continue
        if math.hypot(shear, normal) > surface.pulled(math.atan2(-normal, shear)):
            return False
    return True
