"""Loads of fingers some of whose tiles have slipped, at fixed tensions: a table of 27 states each.

A phalanx *holds* (or is as it closed), *drags* on along the rock with T = μ N toward its finger's
base, or is *off* the rock. The moments of normal loads and of shears about the joints, A and B,
balance what they did when the finger closed, N₀ and T₀ being the loads of the plan,

    A N + B T = A N₀ + B T₀

for each joint that contacts support. Where a contact bears the share w of what balances its joint
(`hand_models.finger.Contact`), all terms but those of its own normal load are taken w times. A
phalanx that is off carries nothing, and the joint that it supported (its own, or else the nearest
before it that is left) rests at a stop: its row goes. The hand's posture stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger import CONTACT_KINDS
from hand_models.hand import FINGERS
from planner.prepare import HandBatch

__all__ = ["STATE_DIGITS", "FingerStates", "PhalanxState"]


class PhalanxState(IntEnum):
    """State of a phalanx in a simulation: its tile holds, drags along the rock, or is off it."""

    HOLDS = 0
    DRAGS = 1
    OFF = 2


STATE_DIGITS: Final = np.array([[s // 9, s // 3 % 3, s % 3] for s in range(27)])
"""State of the proximal, middle and distal phalanx in each of the 27 states of a finger."""

PLACE_VALUES: Final = np.array([9, 3, 1])


@dataclass(frozen=True, slots=True)
class FingerStateSettings:
    """Tolerances of the states of fingers."""

    force: float = 3e-6
    """Part of the largest load of a plan by which a hard row may be violated: plans keep to them to
    1e-6 of it."""
    singular: float = 1e-9
    """Lever arm that is none [m]: with it, contacts cannot balance a joint, and all are off."""


FINGER_STATE_SETTINGS: Final = FingerStateSettings()


@dataclass(frozen=True, eq=False)
class FingerStates:
    """Loads of F fingers in each of 27 states, at the tensions of a plan.

    Attributes
    ----------
    shears, normals : ndarray, shape (F, 27, 3)
        T and N of each phalanx [N].
    rests : ndarray of int, shape (F, 27)
        State in which a finger comes to rest from each state, as phalanges that cannot hold go off:
        those dragged backwards while they pull, frames and dragging tiles that pull.
    slips : ndarray of int, shape (F, 27, 3)
        The same once each phalanx has slipped: it drags if it is pressed, and is off if it pulls.
    base_lifts : ndarray of bool, shape (F, 27)
        Whether a tile on the finger's base cannot hold, by what its proximal phalanx does.
    """

    shears: Array
    normals: Array
    rests: Indices
    slips: Indices
    base_lifts: NDArray[np.bool_]

    @classmethod
    def of(cls, batch: HandBatch, loads: Array, dragging: NDArray[np.bool_]) -> FingerStates:
        """Return the states of the fingers of a plan.

        Parameters
        ----------
        batch : HandBatch
            The hands as they closed.
        loads : ndarray, shape (T, 3)
            Shear, normal and lateral load of each tile in the plan [N].
        dragging : ndarray of bool, shape (T,)
            Tiles that drag already.
        """
        places, touch = batch.places, batch.touch
        own = places.phalanges
        count, tolerance = (
            len(own),
            FINGER_STATE_SETTINGS.force * max(1.0, float(np.abs(loads).max())),
        )
        friction = batch.friction[own]
        gives = concatenated_allowances(batch)
        A, B = _moments(batch)
        T0, N0 = loads[own, 0], loads[own, 1]
        joint_of, bears = _supports(batch)
        touching = (touch.touches[own] > 0.0)[:, None]
        framed = (touch.framed[own] > 0.0)[:, None]
        held = STATE_DIGITS == PhalanxState.HOLDS
        drags = (STATE_DIGITS == PhalanxState.DRAGS) & touching
        lifted = ~held & ~drags
        # rows: of each phalanx the joint that it supports
        row = np.arange(count)[:, None]
        arms, rubs, share = A[row, joint_of], B[row, joint_of], batch.bearing_shares
        gone = dragging[own]
        due = _rows(arms, rubs, share, np.where(gone, friction, 0.0)) @ N0[..., None]
        due = due[..., 0] + share * np.einsum("fij,fj->fi", rubs, np.where(gone, 0.0, T0))
        given = np.where(held & touching & ~gone[:, None], T0[:, None], 0.0)
        drags |= held & gone[:, None]
        mu = np.where(drags, friction[:, None], 0.0)
        M = _rows(arms[:, None], rubs[:, None], share[:, None], mu)
        right = due[:, None] - share[:, None] * np.einsum("fij,fsj->fsi", rubs, given)
        idle = lifted | ~bears[:, None]
        M = np.where(idle[..., None], np.eye(3), np.where(idle[:, :, None], 0.0, M))
        bad = np.abs(np.linalg.det(M)) < FINGER_STATE_SETTINGS.singular
        M[bad], right[bad] = np.eye(3), 0.0
        N = np.linalg.solve(M, np.where(idle, 0.0, right)[..., None])[..., 0]
        T = np.where(drags, friction[:, None] * N, given)
        T[bad] = 0.0
        # by how much each contact lacks what it needs
        holds = T + friction[:, None] * N + gives[own][:, None]
        room = np.where(held & touching & ~drags, holds, np.inf)
        room = np.where(drags | (held & framed), N, room)
        short = room.min(axis=2) < -tolerance
        worst = room.argmin(axis=2)
        after = (
            np.arange(27)
            + (PhalanxState.OFF - STATE_DIGITS[np.arange(27), worst]) * PLACE_VALUES[worst]
        )
        rests = np.where(short, after, np.arange(27))
        for _ in range(2 * len(PLACE_VALUES)):
            rests = rests[row, rests]
        kind = np.where(N >= 0.0, PhalanxState.DRAGS, PhalanxState.OFF)
        slipped = np.arange(27)[:, None] + (kind - STATE_DIGITS) * PLACE_VALUES
        slips = rests[row[:, None], np.where(held & touching & ~drags, slipped, rests[..., None])]
        lifts = np.zeros((count, 27), dtype=bool)
        first, at = places.base_fingers, places.bases
        mu, spines = batch.friction[at, None], batch.engagement[at, None]
        pressed = loads[at, :1] + mu * spines * N[first, :, 0] + gives[at, None]
        lifts[first] = (pressed < -tolerance) & (touch.touches[at, None] > 0.0)
        return cls(T, np.asarray(N, dtype=float), rests, slips, lifts)


def concatenated_allowances(batch: HandBatch) -> Array:
    """Return the drag allowances of all tiles, shape (T,) [N]; see `SettledHand`."""
    return np.concatenate([hand.drag_allowances for hand in batch.hands])


def _rows(arms: Array, rubs: Array, share: Array, friction: Array) -> Array:
    """Return the rows of the joints' balance over normal loads, shape (…, 3, 3) [m].

    Parameters
    ----------
    arms, rubs : ndarray, shape (…, 3, 3)
        Moments of unit normals and of unit shears about the joint that each phalanx supports [m].
    share : ndarray, shape (…, 3)
        Share of what balances its joint that each contact bears.
    friction : ndarray, shape (…, 3)
        μ of phalanges that drag, zero for the others.
    """
    whole = arms + rubs * friction[..., None, :]
    return np.asarray(np.where(np.eye(3, dtype=bool), whole, share[..., None] * whole))


def _moments(batch: HandBatch) -> tuple[Array, Array]:
    """Return moments of unit normals and unit shears about the joints, (F, 3, 3) each [m].

    Rows: joints; columns: phalanges.
    """
    own, found = batch.places.phalanges, []
    for h, hand in enumerate(batch.hands):
        fingers = own[len(FINGERS) * h : len(FINGERS) * (h + 1)]
        for frame, joints, tiles in zip(
            hand.hand.frames(hand.grasp.outer_rotation), hand.postures.joints, fingers, strict=True
        ):
            places, axes = batch.points[tiles] - frame.joint, batch.axes[tiles]
            x = places @ frame.along - joints.real[:, None]
            z = places[:, 2] - joints.imag[:, None]
            found.append(
                [np.triu(x * axes[:, i, 2] - z * (axes[:, i] @ frame.along)) for i in (1, 0)]
            )
    normals, shears = np.array(found).swapaxes(0, 1)
    return normals, shears


def _supports(batch: HandBatch) -> tuple[Indices, NDArray[np.bool_]]:
    """Return the joint that each phalanx supports, and which phalanges bear, shape (F, 3) each."""
    kinds = np.concatenate([hand.postures.kinds for hand in batch.hands])
    bears = kinds != CONTACT_KINDS.index("none")
    if any(hand.grasp.fingernail for hand in batch.hands):
        bears &= False
    joint_of = np.tile(np.arange(3), (len(bears), 1))
    for own, bearing, stops in zip(joint_of, bears, batch.stops, strict=True):
        free = [i for i in range(3) if stops[i] == 0]
        for j in range(3):
            near = [i for i in free if i <= j]
            if bearing[j] and near:
                own[j] = near[-1]
                free.remove(near[-1])
            else:
                bearing[j] = False
    return joint_of, bears
