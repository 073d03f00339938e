"""What its tendon loads a finger with that rests on all its phalanges.

The equations of `hand_models.finger` with every joint free: the distal one's holds the distal
normal load alone, the middle one's that and its own, and so on, so that they are solved from the
tip back.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from hand_models.finger import FingerModel
from hand_models.laying import EDGE, Laid
from hand_models.spines import Surface

__all__ = ["LaidLoads", "TendonLoads", "stays"]

Affine = Sequence[float]
"""A load at zero tension, and per newton of tension."""


class LaidLoads(NamedTuple):
    """Loads of a finger's phalanges, proximal first: at zero tension [N], per newton."""

    shears: tuple[Affine, Affine, Affine]
    normals: tuple[Affine, Affine, Affine]


class TendonLoads:
    """What tendons load fingers of one model with.

    Parameters
    ----------
    model : FingerModel
    """

    def __init__(self, model: FingerModel) -> None:
        self._height, self._gain = model.tile_height, model.shear_gain
        self._engaged = [engagement - model.shear_gain for engagement in model.engagement]
        self._losses = [model.losses(base_tile).tolist() for base_tile in (False, True)]
        self._springs = list(zip(model.joint_stiffness, model.joint_preload, strict=True))
        self._radii = model.pulley_radii

    def loads(self, laid: Sequence[Laid], closing: float, base_tile: bool) -> LaidLoads | None:
        """Return the loads of a finger; None if its contacts cannot hold it.

        Parameters
        ----------
        laid : sequence of Laid
            All its phalanges.
        closing : float
            Tension at which the tiles caught the rock [N].
        base_tile : bool
            Whether a base tile comes first on the tendon.
        """
        losses = self._losses[base_tile]
        (angle_0, _, q_0, c_0, kind_0), (angle_1, u_1, q_1, c_1, kind_1), last = laid
        angle_2, u_2, q_2, c_2, kind_2 = last
        if not min(c_0, c_1, c_2) > 0.0:
            return None
        s_0, s_1, s_2 = (
            (loss * engaged * closing, loss * self._gain) if kind <= EDGE else (0.0, 0.0)
            for loss, engaged, kind in zip(
                losses, self._engaged, (kind_0, kind_1, kind_2), strict=True
            )
        )
        # from earlier joints to later contacts, along and across the contacts' phalanges; from a
        # phalanx's own joint that is (c, h)
        h = self._height
        back = u_2.conjugate()
        point = q_2 + complex(c_2, h) * u_2
        d_12, d_02 = (point - q_1) * back, (point - q_0) * back
        d_01 = (q_1 + complex(c_1, h) * u_1 - q_0) * u_1.conjugate()
        turns = angle_0, angle_1 - angle_0, angle_2 - angle_1
        r_0, r_1, r_2 = (
            (-stiffness * turn - preload, loss * radius)
            for turn, (stiffness, preload), loss, radius in zip(
                turns, self._springs, losses, self._radii, strict=True
            )
        )
        n_0, n_1, n_2 = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        for k in (0, 1):
            n_2[k] = (r_2[k] - h * s_2[k]) / c_2
            left = r_1[k] - h * s_1[k] - d_12.imag * s_2[k]
            n_1[k] = (left - d_12.real * n_2[k]) / c_1
            left = r_0[k] - h * s_0[k] - d_01.imag * s_1[k] - d_02.imag * s_2[k]
            n_0[k] = (left - d_01.real * n_1[k] - d_02.real * n_2[k]) / c_0
        return LaidLoads((s_0, s_1, s_2), (n_0, n_1, n_2))


def stays(laid: Sequence[Laid], loads: LaidLoads, surface: Surface, tension: float) -> bool:
    """Whether no contact of a finger breaks at a tension; as `hand_models.posture_loads.stay`."""
    for phalanx, (t0, t1), (n0, n1) in zip(laid, *loads, strict=True):
        normal = n0 + n1 * tension
        if normal >= 0.0:
            continue
        shear = t0 + t1 * tension
        if phalanx.kind > EDGE or shear < 0.0:
            return False
        # a tile that slips under shear keeps its contact
        if shear > surface.shear_limit:
            continue
        if math.hypot(shear, normal) > surface.pulled(math.atan2(-normal, shear)):
            return False
    return True
