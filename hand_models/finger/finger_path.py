"""Loads of fingers on their way between the open finger and the closed one.

A finger opens as it has closed (`hand_models.finger.closing`), with the tendon's tension f going
down from the closing tension f_c to zero, and these laws in place of those of closing:

- the shear of a tile follows the tendon as that of a closed hand does (Eq. 5),
  T_j = φ_j M_j (τ_j f_c + g_j (f − f_c)), so that below a tension near ¾ f_c the tendon no longer
  drags the tile to the finger's base, but the tile's spring pushes it away;
- a tile that is pressed is dragged backwards by Coulomb friction at most: T_j ≥ −μ N_j;
- spines in pull let go unless their shear, as it is now, is at least μ times the pull;
- nothing is caught anew: φ_j is at most the least share in the finger's balances so far.

Without the friction μ most fingers would not open. A finger whose spines still pull at zero tension
is *jammed*.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.finger.closed_finger import starting_angles
from hand_models.finger.model import FingerModel
from hand_models.finger.path_state import (
    JOINT_COUNT,
    Balanced,
    OpenFinger,
    Records,
    drives,
    held_share,
    open_states,
)
from hand_models.finger.phalanx_shape import PhalanxShape, fan_out
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.finger.settled_finger import SettledFinger
from hand_models.sections import Complexes, Flags, Outlines

__all__ = ["FingerPath", "closing_paths", "opening_paths"]


class FingerPath(NamedTuple):
    """Balanced states of a finger whose tendon is tightened, or let go, in their order.

    Attributes
    ----------
    tensions : ndarray, shape (k,)
        Tension of the tendon [N]; never against its direction.
    joints : ndarray, shape (k, 3)
        q, joint angles [rad].
    shears, normals : ndarray, shape (k, 3)
        Loads of each phalanx on the rock [N].
    places, pushes : ndarray of complex, shape (k, 3)
        In the finger frame F, x + i z: place of each contact [m], and unit vector along which its
        normal load acts; the shear acts along i times that.
    across : ndarray, shape (k, 3)
        Distance of each contact from the finger's plane, along y of F [m].
    bears : ndarray of bool, shape (k, 3)
        Whether each phalanx presses on the rock, or is held to it.
    engagement : ndarray, shape (k, 3)
        Share of each tile's spines that hold.
    touches : ndarray, shape (3,)
        Tension at which each phalanx of a closing finger first touches the rock [N]; NaN if never.
    rests : bool
        Whether the finger came to rest at the end.
    """

    tensions: Array
    joints: Array
    shears: Array
    normals: Array
    places: Complexes
    pushes: Complexes
    across: Array
    bears: Flags
    engagement: Array
    touches: Array
    rests: bool


def closing_paths(model: FingerModel, closings: Sequence[OpenFinger]) -> list[FingerPath]:
    """Return the closing paths of n fingers that can close, from zero to the closing tension.

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger, length n
    """
    shape, rock, drive = _around(model, closings)
    start = open_states(starting_angles([each.rock for each in closings], rock, shape, drive))
    return list(_paths(model, shape, rock, drive, start))


def opening_paths(
    model: FingerModel, closings: Sequence[OpenFinger], fingers: Sequence[SettledFinger]
) -> list[FingerPath]:
    """Return the opening paths of n closed fingers, from the closing tension to zero.

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger, length n
        The fingers as they were before they closed.
    fingers : sequence of SettledFinger, length n
        As they have closed.
    """
    from hand_models.finger.around import around_rock

    shape, rock, drive = _around(model, closings)
    q = np.array([finger.joint_angles for finger in fingers])
    around, start = around_rock(rock, shape, drive, q), open_states(q)
    drive["lowers"], drive["end"], start["been"] = 1, drive["closing"], 1
    for i, (finger, closing) in enumerate(zip(fingers, closings, strict=True)):
        shears = finger.shears(closing.tension, closing.base_tile)
        normals = finger.normals(shears, closing.base_tile) @ [1.0, closing.tension]
        gap, bears = around["gap"][i], np.isin(range(JOINT_COUNT), finger.bearing)
        share, caught = finger.engagement, np.array(finger.touching)
        # one that is laid in closed form is off its bed of springs by some micrometres
        near = bears & (gap <= SETTINGS.lost_gap * shape.length)
        held = caught & ~near & (normals < 0.0)
        start["mode"][i] = np.select(
            [near, held], [CONTACT_CODES.on, CONTACT_CODES.held], CONTACT_CODES.off
        )
        sides = {"upper": 1, "lower": -1}
        start["stop"][i] = [sides.get(str(contact.stop), 0) for contact in finger.contacts]
        start["most"][i] = share
        start["off"][i] = np.maximum(around["share"][i] - share, 0.0)
        start["least"][i] = np.where(caught, np.maximum(gap, 0.0), np.inf)
        start["normals"][i] = np.where(near | held, normals, 0.0)
    return list(_paths(model, shape, rock, drive, start))


def _around(
    model: FingerModel, closings: Sequence[OpenFinger]
) -> tuple[PhalanxShape, Outlines, Records]:
    """Return shape, rock and drive of fingers."""
    shape = PhalanxShape.of(model)
    rocks = [closing.rock for closing in closings]
    rock = Outlines.of(rocks, model.reach + model.tile_length, shape.spacing)
    return shape, rock, drives(model, closings)


def _paths(
    model: FingerModel, shape: PhalanxShape, rock: Outlines, drive: Records, start: Records
) -> Iterator[FingerPath]:
    """Yield the balanced states of fingers on their paths."""
    from hand_models.finger.closing import follow

    courses: list[list[Balanced]] = [[] for _ in start]
    _, _, resting = follow(rock, shape, drive, start, courses)
    for course, own, rests in zip(courses, drive, resting.tolist(), strict=True):
        state, around, forces = (np.concatenate(each) for each in zip(*course, strict=True))
        f = np.minimum(state["s"], own["closing"])
        joints, u = fan_out(state["q"], model.joint_spacing)
        slides = state["slides"] != 0
        shears = np.where(slides, -own["limits"][4] * state["normals"], forces["shears"])
        yield FingerPath(
            own["closing"] - f if own["lowers"] else f,
            state["q"],
            shears,
            state["normals"],
            joints + around["place"] * u,
            around["push"] * u,
            around["across"],
            state["mode"] != CONTACT_CODES.off,
            held_share(state, around),
            state["touches"][-1],
            rests,
        )
