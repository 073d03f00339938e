"""Load sharing of a palm: N tiles on one tendon with friction (Eqs. 1–3, 18–19).

The palm frame travels x; tile i, on a contact of stiffness k_i and preload springs k_p, travels
x_i and lags by the slip δ_i = x − x_i. With tensions A_i and B_i of its strands, before and after
its pulley, the tiles obey

    A_i + B_i + k_p δ_i = k_i x_i            (balance, Eq. 18)
    Σ δ_i = 0                                (the tendon's length)

and the tendon passes tile i's pulley by m_i = 2 Σ_{j<i} δ_j + δ_i and the palm's pulley between
tiles i and i + 1 by n_i = 2 Σ_{j≤i} δ_j, toward its first strand. In a change of load the tension s
before a pulley and s′ after it obey (Eq. 19)

    s′ = ρ s  if the travel grows,  s = ρ s′  if it shrinks,  between the two if the tendon sticks,

with ρ = (1 − μ/2)/(1 + μ/2), at the tiles' pulleys with one μ, at the palm's with another, which
Eq. 18 leaves out (μ = 0: A_{i+1} = B_i). The directions are unknown: each change of load is a
linear complementarity problem. From rest, as here, all results are proportional to x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError
from hand_models.tendon.complementarity import stick_slip
from hand_models.tendon.finger_tendon import LEAST_FRICTION

__all__ = ["PalmSharing", "check_palm", "share_load", "shear_capacity", "shear_stiffness"]


@dataclass(frozen=True, eq=False)
class PalmSharing:
    """Load and travel of each palm tile, per unit of palm travel from rest.

    Attributes
    ----------
    tile_stiffness : ndarray, shape (N,)
        Load of each tile over the palm's travel, k_i x_i / x [N/m].
    tile_travel : ndarray, shape (N,)
        Travel of each tile over the palm's travel, x_i / x.
    """

    tile_stiffness: Array
    tile_travel: Array

    def capacity(self, tile_limits: Sequence[float] | Array) -> float:
        """Return the palm's load when its first tile reaches its limit [N].

        ``tile_limits``: strength of each of the N tiles [N].
        """
        limits = np.asarray(tile_limits, dtype=float)
        return float(np.min(limits / self.tile_stiffness) * self.tile_stiffness.sum())


def check_palm(
    contact_stiffness: Sequence[float],
    spring_stiffness: float,
    friction: float,
    own_friction: float,
) -> None:
    """Raise if stiffnesses or frictions of a palm are impossible.

    Parameters
    ----------
    contact_stiffness : sequence of float, length N
        k_i of each tile on the rock [N/m].
    spring_stiffness : float
        k_p of each tile's preload springs [N/m].
    friction, own_friction : float
        μ at the tiles' pulleys, and at the palm's pulleys between tiles.

    Raises
    ------
    InvalidInputError
        If a k_i is not above zero, k_p is negative, or a friction is not in [0, 2).
    """
    k = [float(k_i) for k_i in contact_stiffness]
    if not k or not all(math.isfinite(k_i) and k_i > 0.0 for k_i in k):
        raise InvalidInputError(
            f"stiffnesses above 0 N/m are needed, got {k}", field="contact_stiffness"
        )
    if not (math.isfinite(spring_stiffness) and spring_stiffness >= 0.0):
        raise InvalidInputError(
            f"must be finite and at least 0 N/m, got {spring_stiffness:g}",
            field="spring_stiffness",
        )
    for field, mu in (("friction", friction), ("own_friction", own_friction)):
        if not 0.0 <= mu < 2.0:
            raise InvalidInputError(f"must be in [0, 2), got {mu:g}", field=field)


def share_load(
    contact_stiffness: Sequence[float],
    spring_stiffness: float,
    friction: float,
    own_friction: float = 0.0,
) -> PalmSharing:
    """Return how N palm tiles on one tendon share a load from rest.

    Solved as a linear complementarity problem (`stick_slip`), with the symbols of this module.
    Tensions are in units of the mean contact stiffness (so they are lengths), the palm's travel is
    one. Of each pulley with friction the unknown is a in s′ = ρ s + ω a, ω = 1/ρ − ρ. All strands
    are affine in a, with the first tension from the tendon's length, and so are the slips
    δ = (k x − A − B)/(k + k_p) and the tendon's travels past the pulleys.

    Parameters
    ----------
    contact_stiffness : sequence of float, length N
        k_i of each tile on the rock, in the tendon's order [N/m].
    spring_stiffness : float
        k_p of each tile's preload springs [N/m].
    friction : float
        μ at the tiles' pulleys, in [0, 2).
    own_friction : float, optional
        μ at the palm's N − 1 pulleys between the tiles, in [0, 2).

    Raises
    ------
    InvalidInputError
        If a stiffness is not above zero, k_p is negative, or a friction is out of range.
    SolverError
        If the complementarity problem ends without a solution.
    """
    check_palm(contact_stiffness, spring_stiffness, friction, own_friction)
    k = np.array(contact_stiffness, dtype=float)
    scale = k.mean()
    kappa = k / scale
    compliance = 1.0 / (kappa + spring_stiffness / scale)
    pull = compliance * kappa
    ratio, travel_of_slip, beside = _thread(len(k), friction, own_friction)

    def pair(strands: Array) -> Array:
        """Return A + B of every tile."""
        return np.asarray(strands[beside[:, 0]] + strands[beside[:, 1]])

    # G and g: products of the ratios between two strands
    logs = np.concatenate([[0.0], np.cumsum(np.log(ratio))])
    decay = np.tril(np.exp(np.minimum(logs[:, None] - logs[None, :], 0.0)))
    by_first, by_a = decay[:, 0], decay[:, 1:] * (1.0 / ratio - ratio)
    weight = np.zeros(len(logs))
    np.add.at(weight, beside, compliance[:, None])
    by_load = by_first / (weight @ by_first)
    by_a = by_a - np.outer(by_load, weight @ by_a)
    constant = by_load * pull.sum()
    a = stick_slip(
        (
            -travel_of_slip @ (compliance[:, None] * pair(by_a)),
            travel_of_slip @ (pull - compliance * pair(constant)),
        ),
        (by_a[:-1], constant[:-1]),
    )
    travel = 1.0 - pull + compliance * pair(by_a @ a + constant)
    return PalmSharing(k * travel, travel)


def _thread(n: int, of_tiles: float, of_palm: float) -> tuple[Array, Array, Indices]:
    """Return how the tendon of n tiles runs over the pulleys that have friction.

    Returns
    -------
    ratio : ndarray, shape (P,)
        ρ of each pulley (Eq. 19).
    travel_of_slip : ndarray, shape (P, N)
        V, the tendon's travels past them by slip.
    strands : ndarray of int, shape (N, 2)
        Which of the P + 1 strands lie before and after each tile's pulley.
    """
    travels = np.empty((2 * n - 1, n))
    travels[::2] = 2.0 * np.tril(np.ones((n, n))) - np.eye(n)
    travels[1::2] = 2.0 * np.tril(np.ones((n - 1, n)))
    friction = np.full(2 * n - 1, of_tiles, dtype=float)
    friction[1::2] = of_palm
    rubs = friction > LEAST_FRICTION
    after = np.cumsum(rubs)
    strands = np.stack([np.concatenate([[0], after[:-1]])[::2], after[::2]], axis=1)
    half = friction[rubs] / 2.0
    return (1.0 - half) / (1.0 + half), travels[rubs], strands


@lru_cache(maxsize=4096)
def _shared(
    contact_stiffness: tuple[float, ...], spring: float, friction: float, own_friction: float
) -> PalmSharing:
    return share_load(contact_stiffness, spring, friction, own_friction)


def shear_capacity(
    contact_stiffness: tuple[float, ...],
    spring_stiffness: float,
    friction: float,
    tile_limit: float,
    own_friction: float = 0.0,
) -> float:
    """Return the shear that a palm carries when its first tile reaches ``tile_limit`` [N].

    Parameters
    ----------
    contact_stiffness : tuple of float, length N
        k_i of each engaged tile on the rock, in the tendon's order [N/m].
    spring_stiffness : float
        k_p of each tile's preload springs [N/m].
    friction : float
        μ at the tiles' pulleys, in [0, 2).
    tile_limit : float
        Shear strength of one tile [N].
    own_friction : float, optional
        μ at the palm's pulleys between the tiles, in [0, 2).
    """
    sharing = _shared(contact_stiffness, spring_stiffness, friction, own_friction)
    return sharing.capacity(np.full(len(contact_stiffness), tile_limit))


def shear_stiffness(
    contact_stiffness: tuple[float, ...],
    spring_stiffness: float,
    friction: float,
    own_friction: float = 0.0,
) -> float:
    """Return the load of a palm's tiles together over its travel from rest [N/m].

    Parameters are those of `share_load`.
    """
    sharing = _shared(contact_stiffness, spring_stiffness, friction, own_friction)
    return float(sharing.tile_stiffness.sum())
