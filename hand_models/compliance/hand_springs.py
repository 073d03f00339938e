"""Springs of hands beside those in their fingers' planes (Section 5.3).

Across its plane a finger's tiles are springs on a beam that leaves the base along the finger
(Section 5.3: linear elasticity),

    Y = (F + diag(1 / k))⁻¹ y,    F_ij = ℓ_i² (3 ℓ_j − ℓ_i) / (6 EI) + h_i h_j ℓ_i / GJ,  ℓ_i ≤ ℓ_j,

with Y the lateral load of each tile, y its displacement across the finger's plane, k the stiffness
of its spines on the rock, ℓ its distance along the finger from the joint and h its distance from
the finger's axis. The engaged palm tiles drag the rock by the palm's travel toward −x and share
that load on their tendon; each presses by its travel past its gap to the rock. A spring of
stiffness k carries k d²/(2 δ) at a travel d up to its onset δ, and k (d − δ/2) beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from hand_models.compliance.link import Numbers
from hand_models.hand import SettledHand

__all__ = ["PalmSprings", "lateral_stiffness"]


class PalmSprings:
    """One-sided springs of the palms of H hands.

    Parameters
    ----------
    hands : sequence of SettledHand, length H

    Attributes
    ----------
    stiffness : ndarray, shape (H, 2, 9)
        Row 0: stiffness of the palm's shear, in column 0; row 1: stiffness of the pressing of each
        of its 8 tiles, in columns 1 to 8; all else zero [N/m].
    """

    def __init__(self, hands: Sequence[SettledHand]) -> None:
        gaps = np.array([each.palm.gaps for each in hands])
        tiles = gaps.shape[1]
        self.stiffness = np.zeros((len(hands), 2, 1 + tiles))
        for springs, settled in zip(self.stiffness, hands, strict=True):
            hand, palm = settled.hand, settled.palm
            springs[0, 0] = settled.palm_shear_stiffness
            pressing = np.array(palm.engagement) * hand.palm_pressing_stiffness
            springs[1, [1 + i for i in palm.engaged]] = pressing
        nearest = np.where(self.stiffness[:, 1, 1:] > 0.0, np.maximum(gaps, 0.0), 0.0)
        self._gaps = np.pad(nearest, ((0, 0), (1, 0)))[..., None]
        self._of_travel = [0] + [1] * tiles
        # [m] 0.1 mm of shear and 0.02 mm of pressing, over which a search sees the springs begin
        self._onset = np.array([1e-4] + [2e-5] * tiles)[:, None]

    def loads(self, travel: Numbers) -> Numbers:
        """Return the palms' shear toward −x of H and pressing along +z, shape (H, 2, m) [N].

        ``travel``: displacement of each palm toward −x and +z of H, shape (H, 2, m) [m].
        """
        onset, beyond = self._onset, travel[:, self._of_travel] - self._gaps
        part = np.where(beyond.real < onset, np.where(beyond.real > 0.0, beyond, 0.0), onset)
        return np.asarray(self.stiffness @ (part / onset * (beyond - 0.5 * part)))


def lateral_stiffness(hands: Sequence[SettledHand], out: Array, high: Array) -> Array:
    """Return the stiffness of n tiles across their fingers' planes, shape (H, n, n) [N/m].

    Parameters
    ----------
    hands : sequence of SettledHand, length H
    out, high : ndarray, shape (H, n)
        ℓ and h, how far each tile is along its finger's axis, and from it [m].
    """

    def of_hands(name: str) -> Array:
        return np.array([getattr(each.hand, name) for each in hands])[:, None, None]

    shorter = np.minimum(out[:, :, None], out[:, None])
    longer = np.maximum(out[:, :, None], out[:, None])
    flexibility = shorter**2 * (3.0 * longer - shorter) / (6.0 * of_hands("bending_stiffness"))
    flexibility += high[:, :, None] * high[:, None] * shorter / of_hands("torsional_stiffness")
    finger = hands[0].finger_of
    flexibility *= finger[:, None] == finger
    spines = np.array([each.engagement * each.grasp.lateral for each in hands])[..., None]
    springs = spines * of_hands("lateral_stiffness") * np.eye(len(finger))
    # as (F + 1/K)⁻¹, also where tiles have no spines on the rock
    return np.asarray(np.linalg.solve(np.eye(len(finger)) + springs @ flexibility, springs))
