"""The full equilibrium of every finger of a stance (Eqs. 5–8), for the check of plans.

For each finger A f_c = b is solved with its joint rows and tile rows, the contact forces in the
finger's frame (x along the finger, z into the rock), for b at no tension and per newton of it. A
vector (x, z) is the complex number x + i z, so that i a · f is the moment of a force f on the arm a
and the product with the conjugate of u turns into the frame of a phalanx along u. Nothing here is
shared with the way settled hands find their affine maps (Eq. 14).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger import PHALANGES, STOPS
from hand_models.hand import FINGERS, HandModel
from planner.prepare import (
    KEPT,
    NONE,
    NOTHING,
    HandBatch,
    TileIndex,
    concatenated,
)

__all__ = ["JOINTS", "SIDES", "Equilibrium", "TendonEffects", "equilibrium", "tendons_of"]

JOINTS: Final = len(PHALANGES)

SIDES: Final = np.array([{"upper": 1.0, "lower": -1.0}.get(str(stop), 0.0) for stop in STOPS])
"""Which way a joint presses on the limit at which it stands, by code of `STOPS`."""

TURNS: Final = 1j * np.tri(JOINTS).T
"""i for a force on a phalanx at or beyond a joint, which it turns; i a is (−a_z, a_x)."""


class Equilibrium(NamedTuple):
    """What fingers carry, affine in their tendons' tensions: at zero, and per newton.

    Attributes
    ----------
    rows : ndarray, shape (2, n)
        All of what follows: shears, normals, tendons drawn in, stops.
    fingers : ndarray of int, shape (n,)
        Whose each of these is.
    shear, normal : ndarray, shape (2, T)
        Of each tile [N]; of nails zero.
    drawn : ndarray, shape (2, F)
        How much tendon joints and tiles have drawn in, without the nail [m].
    stops : ndarray, shape (2, k)
        Torque with which each joint that stands at a limit presses on it, of fingers that touch
        rock [N·m].
    stop_fingers, stop_joints : ndarray of int, shape (k,)
        Which joints these are.
    """

    rows: Array
    fingers: Indices
    shear: Array
    normal: Array
    drawn: Array
    stops: Array
    stop_fingers: Indices
    stop_joints: Indices


def equilibrium(known: HandBatch) -> Equilibrium:
    """Solve the equilibrium of all fingers of settled hands.

    Raises
    ------
    numpy.linalg.LinAlgError
        If contacts do not hold the joints that are free.
    """
    hands, places = known.hands, known.places
    tendons = tendons_of(places, hands[0].hand)
    contacts = known.touch.contacts[places.phalanges]
    closing = np.array([hand.closing_tension for hand in hands])
    loads, left = _solved(known, contacts, tendons, closing.repeat(len(FINGERS))[:, None])

    fingers = joints = NONE
    owners = tendons.owners
    if len(known.touch.touching) < len(places.hand) and known.stops.any():
        sides = SIDES[known.stops] * (contacts != NOTHING).any(axis=1, keepdims=True)
        fingers, joints = sides.nonzero()
        owners = np.concatenate((owners, fingers))
    count = len(places.hand)
    rows = np.zeros((2, len(owners)))
    planar = rows[:, : 2 * count].reshape(2, 2, count)
    planar[:, :, places.phalanges] = loads
    shear, bases = planar[:, 0], places.bases
    base = known.engagement[bases]
    shear[0, bases] = base * (tendons.engaged[bases] * closing[places.hand[bases]])
    shear[1, bases] = base * tendons.gain[bases]
    # Eq. 5: a tile's spring and the rock's shear balance the tendon's two strands
    drawn = rows[:, 2 * count : 2 * count + len(contacts)]
    np.add.reduceat(shear, places.first_of_finger, axis=1, out=drawn)
    drawn *= -tendons.travel
    drawn += tendons.drawn
    drawn[0] += known.bends @ tendons.radii
    stops = rows[:, len(tendons.owners) :]
    if len(fingers):
        stops[:] = left.transpose(2, 0, 1)[:, fingers, joints] * sides[fingers, joints]
    return Equilibrium(rows, owners, shear, planar[:, 1], drawn, stops, fingers, joints)


class TendonEffects(NamedTuple):
    """What the fingers' tendons do at their joints and tiles, all of which touch.

    Attributes
    ----------
    per_newton : ndarray, shape (F, 6)
        b of A f_c = b per newton of tension: −M r of the joints, M g of the tiles.
    at_closing : ndarray, shape (F, 6)
        b at zero tension per newton of closing tension: M (τ − g) of the tiles.
    stiffness, preload : ndarray, shape (3,)
        Of the joints' springs [N·m/rad], [N·m].
    radii : ndarray, shape (3,)
        Of the pulleys [m].
    travel : float
        How much tendon a tile draws in per newton of its spring [m/N].
    drawn : ndarray, shape (2, F)
        How much tiles without shear draw in, at no tension and per newton of it [m].
    pull : ndarray, shape (F, 3)
        M r of the joints [m].
    gain, engaged : ndarray, shape (T,)
        Shear of each tile per newton of tension, and at zero tension per newton of closing tension;
        of nails zero.
    owners : ndarray of int
        Fingers of `Equilibrium.rows`, but stops.
    """

    per_newton: Array
    at_closing: Array
    stiffness: Array
    preload: Array
    radii: Array
    travel: float
    drawn: Array
    pull: Array
    gain: Array
    engaged: Array
    owners: Indices


@lru_cache(maxsize=KEPT)
def tendons_of(places: TileIndex, hand: HandModel) -> TendonEffects:
    """Return what the tendons of hands do, all of one model."""
    model, drive = hand.finger, hand.drive
    loss = 1.0 - model.friction
    # what is left of the tension at each phalanx's tile; a base tile comes first
    local: Array = np.full((len(places.phalanges), JOINTS), loss) ** np.arange(JOINTS)
    local[places.base_fingers] *= loss
    per_newton, at_closing = np.zeros((2, len(local), 2 * JOINTS))
    radii = np.array(model.pulley_radii)
    per_newton[:, 0::2], per_newton[:, 1::2] = -local * radii, local * model.shear_gain
    at_closing[:, 1::2] = local * (np.array(model.engagement) - model.shear_gain)
    gain, engaged = np.zeros((2, len(places.hand)))
    gain[places.phalanges], engaged[places.phalanges] = per_newton[:, 1::2], at_closing[:, 1::2]
    gain[places.bases] = model.shear_gain
    engaged[places.bases] = model.base_engagement - model.shear_gain
    travel = drive.pulley_ratio / drive.tile_stiffness
    strands = local.sum(axis=1)
    strands[places.base_fingers] += 1.0
    drawn = np.zeros((2, len(local)))
    drawn[1] = travel * drive.pulley_ratio * strands
    return TendonEffects(
        per_newton=per_newton,
        at_closing=at_closing,
        stiffness=np.array(model.joint_stiffness),
        preload=np.array(model.joint_preload),
        radii=radii,
        travel=travel,
        drawn=drawn,
        pull=local * radii,
        gain=gain,
        engaged=engaged,
        owners=np.concatenate((places.finger, places.finger, np.arange(len(local)))),
    )


def _solved(
    known: HandBatch, contacts: Indices, tendons: TendonEffects, closing: Array
) -> tuple[Array, Array]:
    """Return what A f_c = b gives.

    Returns
    -------
    loads : ndarray, shape (2, 2, F, 3)
        At zero tension and per newton: shear and normal of each phalanx.
    left : ndarray, shape (F, 3, 2)
        What is left of each joint's balance, at zero tension and per newton [N·m]; only worked
        out where a phalanx bears nothing.
    """
    model = known.hands[0].hand.finger
    alongs, rises, tilts = (
        concatenated([getattr(hand.postures, name) for hand in known.hands])
        for name in ("alongs", "rises", "tilts")
    )
    u = np.exp(1j * known.angles)
    steps = model.joint_spacing * u
    joints = steps.cumsum(axis=1) - steps
    points = joints + (alongs + 1j * (model.tile_height + rises)) * u
    # from here on along the tiles' drag, which is aside of phalanges that press aside
    u = u * np.exp(1j * tilts)
    count = len(u)
    A = np.zeros((count, 2 * JOINTS, JOINTS), dtype=complex)
    # a force of the rock on phalanx j turns joint i ≤ j from x toward z (Jᵀ f_c)
    np.multiply(points[:, None, :] - joints[:, :, None], TURNS, out=A[:, 0::2])
    # a tile's force along +x of its phalanx is the shear; a bare frame only presses
    A.reshape(count, -1)[:, JOINTS :: 2 * JOINTS + 1] = u
    b = np.empty((count, 2 * JOINTS, 2))
    b[:, :, 0], b[:, :, 1] = closing * tendons.at_closing, tendons.per_newton
    b[:, 0::2, 0] += known.bends * tendons.stiffness + tendons.preload
    partly, left = len(known.touch.touching) < len(known.touch.contacts), b
    b[:, 1::2] *= known.engagement[known.places.phalanges][:, :, None]
    if partly:
        left = -b[:, 0::2]
        A[:, 0::2] *= (contacts != NOTHING)[:, None, :]
        turns = A[:, 0::2].copy().view(float).reshape(count, JOINTS, 2 * JOINTS)
        _drop(A, b, u, known.stops, contacts != NOTHING)
    forces = np.linalg.solve(A.view(float), b)
    if partly:
        left += turns @ forces
    # T + i N = f̄ u, for the force f of the rock on a phalanx along u
    loads = forces.transpose(2, 0, 1).copy().view(complex)
    np.conjugate(loads, out=loads)
    loads *= u
    return loads.view(float).reshape(2, count, JOINTS, 2).transpose(0, 3, 1, 2), left


def _drop(A: Array, b: Array, u: Array, stops: NDArray[np.int8], bears: NDArray[np.bool_]) -> None:
    """Take joints at a stop out of A f_c = b, and the forces of phalanges that bear nothing."""
    alone = ~bears.any(axis=1, keepdims=True)
    which, held = ((stops > 0) | alone).nonzero()
    idle, phalanx = (~bears).nonzero()
    if not np.array_equal(which, idle):
        raise np.linalg.LinAlgError("contacts do not hold the joints that are free")
    A[which, 2 * held] = 0.0
    A[which, 2 * held, phalanx] = 1j * u[idle, phalanx]
    b[which, 2 * held] = 0.0
