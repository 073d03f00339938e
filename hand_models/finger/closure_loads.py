"""Loads that the tendon puts on a finger that rests on all its phalanges.

The equations of `hand_models.finger.model` with no joint at a limit: the distal joint's equation
has the distal normal load alone, the middle joint's the distal and the middle one, and so on, so
that back substitution from the tip solves them.

A load that is affine in the tendon's tension is one complex number a + i b: a at zero tension [N],
b per newton of tension.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from hand_models.finger.model import PHALANGES, FingerModel
from hand_models.finger.sequential_closure import ClosedPhalanx
from hand_models.tile import Surface

__all__ = ["stays", "tendon_loads"]

WHOLE = (1.0,) * len(PHALANGES)
"""Shares of tiles whose spines are all on the rock."""

Loads = tuple[list[complex], list[complex]]
"""Shears and normal loads of a finger's phalanges, proximal first: a + i b, affine in tension."""


def tendon_loads(
    model: FingerModel,
    laid: Sequence[ClosedPhalanx],
    closing: float,
    base_tile: bool,
    shares: Sequence[float] = WHOLE,
) -> Loads | None:
    """Return shear and normal load of each phalanx of a finger that rests on all three.

    Parameters
    ----------
    model : FingerModel
    laid : sequence of ClosedPhalanx, length 3
        All phalanges of the finger.
    closing : float
        Tension at which the tiles caught the rock [N].
    base_tile : bool
        Whether a base tile comes first on the tendon.
    shares : sequence of float, length 3, optional
        Share of each tile's spines on the rock.

    Returns
    -------
    tuple of list of complex, or None
        Shears, then normal loads, proximal first: a + i b with a the load at zero tension [N] and
        b the load per newton of tension. None if a contact is at or behind its joint.
    """
    if not all(each.along > 0.0 for each in laid):
        return None
    shears: list[complex] = []
    left: list[complex] = []
    before = 0.0
    for i, (angle, _, _, _, _) in enumerate(laid):
        loss, gain = (1.0 - model.friction) ** (i + base_tile), model.shear_gain[i]
        shears.append(shares[i] * loss * complex((model.engagement[i] - gain) * closing, gain))
        # what spring and tendon turn its joint with
        spring = model.joint_stiffness[i] * (angle - before) + model.joint_preload[i]
        left.append(complex(-spring, loss * model.pulley_radii[i]))
        before = angle
    normals = [0j] * len(laid)
    for j in range(len(laid) - 1, -1, -1):
        _, u, joint, along, _ = laid[j]
        left[j] -= model.tile_height * shears[j]
        normals[j] = left[j] / along
        # from earlier joints to the contact, along and across its phalanx
        point, back = joint + complex(along, model.tile_height) * u, u.conjugate()
        for i in range(j):
            arm = (point - laid[i].joint) * back
            left[i] -= arm.imag * shears[j] + arm.real * normals[j]
    return shears, normals


def stays(loads: Loads, surface: Surface, tension: float, shares: Sequence[float] = WHOLE) -> bool:
    """Return True if no contact of a finger that rests on all phalanges breaks at a tension.

    A contact that is pulled off the rock breaks if its drag is less than μ times the pull, or if
    its load is beyond the tile's strength at that angle. A tile that slips, its shear above the
    surface's ``shear_limit``, keeps its contact.

    Parameters
    ----------
    loads : tuple of list of complex
        Result of `tendon_loads`.
    surface : Surface
    tension : float
        Tension of the tendon [N].
    shares : sequence of float, length 3, optional
        Share of each tile's spines on the rock.
    """
    for t, n, share in zip(*loads, shares, strict=True):
        normal = n.real + n.imag * tension
        if normal >= 0.0:
            continue
        shear = t.real + t.imag * tension
        if shear < -surface.friction * normal:
            return False
        # a tile that slips under shear keeps its contact
        if shear > share * surface.shear_limit:
            continue
        if math.hypot(shear, normal) > share * surface.strength(math.atan2(-normal, shear)):
            return False
    return True
