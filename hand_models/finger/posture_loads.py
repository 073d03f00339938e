"""What tendons load fingers with in any contact state, and whether they stay in it.

The equations of `hand_models.finger.model` for many fingers at once. A free joint begins a link of
which one phalanx bears, so that loads follow from the tip back, one unknown at each free joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.model import FingerModel
from hand_models.finger.postures import BALANCE, FREE, LOWER, UPPER, Postures
from hand_models.finger.sequential_closure import EDGE, NONE
from hand_models.sections import Complexes, Flags
from hand_models.tile import Surface, pull_strength

__all__ = ["Loads", "TendonBatch", "left_torque", "loads", "stay", "turns"]

UNBALANCED: Final = 1e-3
"""Torque that may be left at a joint that balances without contact, about half a percent of a
tendon's [N·m]."""

BALANCED: Final = 1e-9
"""How much torque a stop may seem to pull, by rounding [N·m]."""

LEAST, MOST = np.array([[-np.inf] * 4, [np.inf] * 4])
"""Torque that each kind of stop holds, from and to [N·m]."""
LEAST[UPPER], MOST[LOWER] = -BALANCED, BALANCED
LEAST[BALANCE], MOST[BALANCE] = -UNBALANCED, UNBALANCED


LATER: Final = np.triu(np.ones((3, 3)))[..., None]
"""Which phalanges' loads turn a joint: its own and those beyond."""


class TendonBatch(NamedTuple):
    """Tendons of fingers, and what their tiles hold; one finger's serve any number of columns.

    Attributes
    ----------
    closing : ndarray, shape (n,)
        Tension at which the tiles catch the rock [N].
    losses : ndarray, shape (3, n)
        Diagonals of M (Eq. 8).
    drags, pulls : ndarray, shape (3, n)
        Shear of each tile that touches, and torque of the tendon about each joint, at the closing
        tension [N, N·m].
    limits : ndarray, shape (3, n)
        f_max [N], f_min [N] and φ_max [rad] of the surfaces.
    """

    closing: Array
    losses: Array
    drags: Array
    pulls: Array
    limits: Array

    @classmethod
    def of(
        cls,
        model: FingerModel,
        closing: Sequence[float],
        base_tiles: Sequence[bool],
        surfaces: Sequence[Surface],
    ) -> TendonBatch:
        """Gather tendons: tensions at closing, whether a base tile comes first, what rock holds."""
        tension = np.array(closing)
        order = np.arange(len(model.engagement))[:, None] + np.array(base_tiles, dtype=int)
        losses = (1.0 - model.friction) ** order
        local = losses * tension
        return cls(
            tension,
            losses,
            local * np.array(model.engagement)[:, None],
            local * np.array(model.pulley_radii)[:, None],
            np.array([(s.shear_limit, s.pull_off_limit, s.pull_off_angle) for s in surfaces]).T,
        )

    def take(self, fingers: Indices) -> TendonBatch:
        """Return some of them."""
        if len(self.closing) == 1:
            return self
        return TendonBatch(*(value[..., fingers] for value in self))


class Loads(NamedTuple):
    """Loads of fingers: shapes (3, 2, n), at zero tension and per newton of it; or (3, n), at one.

    Attributes
    ----------
    shears, normals : ndarray
        Of each phalanx [N].
    torques : ndarray
        What turns each joint against its limit, as `SettledFinger.stop_torques` [N·m].
    """

    shears: Array
    normals: Array
    torques: Array

    def at(self, tension: Array) -> Loads:
        """Return the loads at tensions, shape (n,)."""
        return Loads(*(value[:, 0] + value[:, 1] * tension for value in self))


def loads(model: FingerModel, fingers: Postures, tendons: TendonBatch) -> Loads:
    """Return the loads of fingers as affine functions of tension (Eqs. 4, 5 and 14).

    They are infinite or NaN where the contacts cannot hold the joints that are free.
    """
    engagement, stiffness, preload, radii = _columns(model)
    local = np.where(fingers.kinds <= EDGE, tendons.losses, 0.0)
    shears, rest = np.empty((2, len(local), 2, local.shape[1]))
    gain = model.shear_gain
    np.multiply(local * (engagement - gain), tendons.closing, out=shears[:, 0])
    np.multiply(local, gain, out=shears[:, 1])
    np.subtract(-stiffness * turns(fingers), preload, out=rest[:, 0])
    np.multiply(radii, tendons.losses, out=rest[:, 1])
    return Loads(shears, *_balance(model, fingers, shears, rest))


@lru_cache(maxsize=32)
def _columns(model: FingerModel) -> Array:
    """Return engagement, stiffness, preload and pulley radius of each joint, shape (4, 3, 1)."""
    numbers = model.engagement, model.joint_stiffness, model.joint_preload, model.pulley_radii
    return np.array(numbers)[..., None]


def turns(fingers: Postures) -> Array:
    """Return how far each joint has turned from the phalanx before it, shape (3, n) [rad]."""
    turned = fingers.angles.copy()
    turned[1:] -= fingers.angles[:-1]
    return turned


def _balance(
    model: FingerModel, fingers: Postures, shears: Array, rest: Array
) -> tuple[Array, Array]:
    """Return the normals that balance the free joints, and what is left at the others."""
    u = np.exp(1j * fingers.angles)
    points, back = fingers.joints + (fingers.alongs + 1j * model.tile_height) * u, u.conj()
    free, waiting = fingers.stops == FREE, fingers.kinds != NONE
    if free.all() and waiting.all():
        return _resting(points, back, fingers.joints, shears, rest), np.zeros_like(shears)
    # where no joint at its limit has a phalanx on the rock, each free one has its own
    own = bool((waiting == free).all())
    normals, arms = np.zeros_like(shears), {}
    joints = range(len(free))
    for i in reversed(joints):
        turned = back[i:] * (points[i:] - fingers.joints[i])
        for j in joints[i:]:
            arms[i, j] = turned[j - i].real
            rest[i] -= turned[j - i].imag * shears[j]
        left = rest[i]
        for j in joints[i + 1 :]:
            left = left - arms[i, j] * normals[j]
        for j in joints[i : i + 1] if own else joints[i:]:
            solved = free[i] & waiting[j]
            normals[j] = np.where(solved, left / arms[i, j], normals[j])
            waiting[j] &= ~solved
    for i, j in arms:
        rest[i] -= arms[i, j] * normals[j]
    return normals, np.where(free[:, None], 0.0, rest)


def _resting(
    points: Complexes, back: Complexes, joints: Complexes, shears: Array, rest: Array
) -> Array:
    """Return the normals of fingers that rest on all phalanges, every joint free."""
    turned = back * (points - joints[:, None])
    arms, across = turned.real, turned.imag * LATER
    left = rest - (across[:, :, None] * shears).sum(axis=1)
    normals = np.empty_like(shears)
    for i in reversed(range(len(joints))):
        for j in range(i + 1, len(joints)):
            left[i] -= arms[i, j] * normals[j]
        np.divide(left[i], arms[i, i], out=normals[i])
    return normals


def left_torque(
    model: FingerModel, fingers: Postures, tendons: TendonBatch, proximal: int
) -> Array:
    """Return the torque that rock beyond a joint's own phalanx leaves at it, shape (n,) [N·m].

    At the closing tensions, positive where it turns the joint in, for fingers of which every later
    phalanx that bears has a free joint of its own.

    Parameters
    ----------
    model : FingerModel
    fingers : Postures
    tendons : TendonBatch
    proximal : int
        Of how many fingers, the first ones, at the proximal joint; of the others at the middle one.
    """
    _, stiffness, preload, _ = _columns(model)
    shears = np.where(fingers.kinds <= EDGE, tendons.drags, 0.0)
    torques = tendons.pulls - preload - stiffness * turns(fingers)
    bears = fingers.kinds != NONE
    u = np.exp(1j * fingers.angles)
    points, back = fingers.joints + (fingers.alongs + 1j * model.tile_height) * u, u.conj()
    normals = np.zeros_like(shears)
    for i in (2, 1, 0) if proximal else (2, 1):
        some = slice(proximal) if i == 0 else slice(None)
        arms = back[i:, some] * (points[i:, some] - fingers.joints[i, some])
        left = arms.imag * shears[i:, some]
        left[1:] += arms[1:].real * normals[i + 1 :, some]
        torque = torques[i, some]
        torque -= left.sum(axis=0)
        np.divide(torque, arms[0].real, out=normals[i, some], where=bears[i, some])
    torques[1, :proximal] = torques[0, :proximal]
    return np.asarray(torques[1])


def stay(fingers: Postures, loads: Loads, tendons: TendonBatch, *, pressed: bool = False) -> Flags:
    """Whether no contact breaks at the closing tensions, and no joint leaves its limit, shape (n,).

    A contact breaks where its tile is pulled off beyond its limit curve; a bare frame only presses.

    Parameters
    ----------
    fingers : Postures
    loads : Loads
        Affine in tension.
    tendons : TendonBatch
    pressed : bool, optional
        Whether tiles may only press as well: spines that were not on the rock before are not
        engaged by pulling.
    """
    shears, normals, torques = loads.at(tendons.closing)
    staying = np.isfinite(normals).all(axis=0)
    if fingers.stops.any():
        held = (torques >= LEAST[fingers.stops]) & (torques <= MOST[fingers.stops])
        staying &= held.all(axis=0)
    pulled = (fingers.kinds != NONE) & ~(normals >= 0.0)
    if pressed or not pulled.any():
        return np.asarray(staying & ~pulled.any(axis=0))
    strongest, weakest, weakest_from = tendons.limits
    strength = pull_strength(strongest, weakest, weakest_from, np.arctan2(-normals, shears))
    holds = (fingers.kinds <= EDGE) & (shears >= 0.0)
    # a tile that slips under shear keeps its contact
    holds &= (shears > strongest) | (np.hypot(shears, normals) <= strength)
    return np.asarray(staying & (holds | ~pulled).all(axis=0))
