"""State of closing fingers, their drive and the rock around them: arrays of records.

Compiled functions (`hand_models.finger.closing`) take the records of one finger and write to them.
Flags are the integers 0 and 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, record_of
from hand_models.finger.model import PHALANGES, FingerModel
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.sections import FingerRock
from hand_models.tile import Surface, engaged_share

__all__ = [
    "AROUND_FIELDS",
    "CODE_RECORD",
    "DRIVE_FIELDS",
    "JOINT_COUNT",
    "SETTINGS_RECORD",
    "SHAPE_FIELDS",
    "STATE_FIELDS",
    "WALK_FIELDS",
    "Balanced",
    "OpenFinger",
    "Record",
    "Records",
    "drives",
    "held_share",
    "open_states",
    "open_walks",
]

JOINT_COUNT: Final = len(PHALANGES)

Record = Any
"""A record in a compiled function; where it is called from outside, an array of one."""

Records = NDArray[np.void]
"""An array of records, one for each finger."""

_EACH_JOINT, _EACH_PAIR = (JOINT_COUNT,), (JOINT_COUNT, JOINT_COUNT)

SETTINGS_RECORD: Final = record_of(asdict(SETTINGS))
"""`FingerSettings`, as compiled functions take them."""

CODE_RECORD: Final = record_of(asdict(CONTACT_CODES))
"""`ContactCodes`, as compiled functions take them."""

SHAPE_FIELDS: Final = PhalanxShape(*[0.0] * len(PhalanxShape._fields)).record.dtype
"""Fields of `PhalanxShape.record`."""

DRIVE_FIELDS: Final = np.dtype(
    [
        *((name, float, _EACH_JOINT) for name in ("pull", "drag", "gain", "depth")),
        *((name, float) for name in ("closing", "end", "torque")),
        ("limits", float, (5,)),
        ("lowers", int),
        *((name, float, _EACH_JOINT) for name in ("stiffness", "preload", "lower", "upper")),
    ]
)
"""Tendon torques, springs, joint limits and tile strengths of a closing or opening finger.

``pull``, ``drag``, ``gain``: M r, the tendon's torque about each joint per newton of tension [m];
M τ, the shear of each tile per newton of tension while it closes; M g, the same once it has closed.
``depth``: depth to which the closing tension presses tiles into their beds of springs [m].
``closing``: closing tension [N]; ``end``: path parameter s at the end of the path [N]; ``torque``:
the tendon's torque about the proximal joint at the closing tension [N·m]. ``limits``: strength of
the surface, f_max [N], f_min [N], φ_max [rad], exponent p and friction μ. ``lowers``: 1 where the
tension is lowered from the closing tension, 2 where it goes on without balance, else 0.
``stiffness``, ``preload``, ``lower``, ``upper``: spring stiffness [N·m/rad], spring preload [N·m]
and angle limits [rad] of the joints.
"""

AROUND_FIELDS: Final = np.dtype(
    [
        *((name, float, _EACH_JOINT) for name in ("gap", "share")),
        *((name, float, _EACH_PAIR) for name in ("a", "b", "d_gap", "d_share")),
        *((name, float, (*_EACH_PAIR, JOINT_COUNT)) for name in ("d_a", "d_b")),
        *((name, complex, _EACH_JOINT) for name in ("place", "push")),
        ("across", float, _EACH_JOINT),
    ]
)
"""Gaps, engagement and lever arms of a finger beside its rock, with derivatives in q.

q are the three joint angles; the last axis of a derivative counts them. ``gap``, ``share``: g_j,
gap of phalanx j to the rock [m], and φ_j, share of its tile's spines on the rock. ``a``, ``b``:
lever arms [m]: the torque about joint i of contact j is T_j a_ij − N_j b_ij, for the shear T_j and
the normal load N_j. ``d_gap``, ``d_share``, ``d_a``, ``d_b``: their derivatives [m/rad], [1/rad].
``place``, ``push``: place of each contact's force [m] and its unit vector toward the rock, in the
phalanx's axes: real part along it, imaginary part above it. ``across``: middle of the engaged part
of each tile, its distance from the finger's plane [m].
"""

STATE_FIELDS: Final = np.dtype(
    [
        ("q", float, _EACH_JOINT),
        ("s", float),
        *((name, int, _EACH_JOINT) for name in ("mode", "stop", "spines", "been", "slides")),
        *((name, float, _EACH_JOINT) for name in ("off", "most", "least", "normals", "touches")),
        *((name, float) for name in ("damping", "stride", "unbalanced")),
        *((name, float, _EACH_JOINT) for name in ("step", "left")),
    ]
)
"""State of a finger on its closing path.

``q``: joint angles [rad]. ``s``: path parameter [N]: the tension, from 0 to the closing tension;
beyond that, up to ``catching_part`` of the closing tension more, the drag on spines across gaps
grows to full. Where ``lowers``, it is how far the tension has been lowered. ``mode``, ``stop``,
``spines``: contact of each phalanx, off, on or held; stop of each joint, +1 at the upper limit, −1
at the lower, else 0; spines of each tile, caught, pulled or lost (codes of `ContactCodes`).
``been``: whether the phalanx has touched the rock since its spines caught. ``slides``: whether the
tile slides away from the finger's base, against friction. ``off``: ψ, share of the tile's spines
that were pulled off and have not caught again. ``least``: m, least gap since the spines caught;
after a pull-off, the gap at which it happened [m]. ``normals``: normal load of each contact [N].
``touches``: value of ``s`` at which the phalanx first touched the rock [N]; NaN if it never did.
``damping``, ``stride``: damping D of the joints [N·m/rad]; largest turn of a joint in the next
increment [rad]. ``unbalanced``: largest torque left after the last increment [N·m]. ``most``: of a
finger that opens, the least share of each tile's spines in its balances so far. ``step``: turn of
the joints in the last increment [rad]. ``left``: torque residual that the linearisation predicts
after it [N·m].
"""

WALK_FIELDS: Final = np.dtype(
    [*((name, int) for name in ("step", "still", "slow", "rests")), ("s", float)]
)
"""How far a finger's path has been followed.

``step``: number of increments; ``still``, ``slow``: of those last in a row at one tension, and with
much damping. ``rests``: whether the finger has come to rest. ``s``: path parameter of the state
before the last one, or of the one that was tried in vain since [N].
"""


class Balanced(NamedTuple):
    """A finger in balance on its path: arrays of one record each.

    Attributes
    ----------
    state, around, forces : ndarray, shape (1,)
        Records of `STATE_FIELDS`, of `AROUND_FIELDS` and, in `contact_states`, `LINEARISED_FIELDS`.
    """

    state: Records
    around: Records
    forces: Records


class OpenFinger(NamedTuple):
    """A finger before closing: rock in its plane, surface and closing tension.

    Attributes
    ----------
    rock : FingerRock
        Rock in the finger's plane, with the proximal joint at the origin of the finger frame F.
    surface : Surface
        Strength of the tiles on the rock.
    tension : float
        Closing tension, at which the tiles catch the rock [N].
    base_tile : bool
        Whether a base tile comes first on the tendon.
    """

    rock: FingerRock
    surface: Surface
    tension: float
    base_tile: bool = False


def drives(model: FingerModel, closings: Sequence[OpenFinger]) -> Records:
    """Return the tendons and springs of n fingers of one model, records of `DRIVE_FIELDS`.

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger, length n
        The fingers' surfaces and closing tensions.

    Returns
    -------
    ndarray, shape (n,)
        Records of `DRIVE_FIELDS`.
    """
    found = np.zeros(len(closings), DRIVE_FIELDS)
    losses = np.array([model.losses(closing.base_tile) for closing in closings])
    closing = np.array([closing.tension for closing in closings])
    surfaces = [closing.surface for closing in closings]
    found["pull"] = losses * np.array(model.pulley_radii)
    found["drag"] = losses * np.array(model.engagement)
    found["gain"] = losses * np.array(model.shear_gain)
    depths = np.array([model.depths(each.base_tile) for each in closings])
    found["depth"] = closing[:, None] * depths
    found["closing"], found["end"] = closing, (1.0 + SETTINGS.catching_part) * closing
    found["torque"] = found["pull"][:, 0] * closing
    found["limits"] = [(*surface.straight_law, surface.friction) for surface in surfaces]
    found["stiffness"], found["preload"] = model.joint_stiffness, model.joint_preload
    found["lower"], found["upper"] = model.joint_lower, model.joint_upper
    return found


def open_states(q: Array) -> Records:
    """Return the states in which fingers begin to close: no tension, no contact, all spines ready.

    Parameters
    ----------
    q : ndarray, shape (n, 3)
        Joint angles of the open fingers [rad].

    Returns
    -------
    ndarray, shape (n,)
        Records of `STATE_FIELDS`.
    """
    found = np.zeros(len(q), STATE_FIELDS)
    found["q"], found["stride"] = q, SETTINGS.first_stride
    found["mode"], found["spines"] = CONTACT_CODES.off, CONTACT_CODES.caught
    found["least"], found["touches"] = np.inf, np.nan
    return found


def open_walks(states: Records) -> Records:
    """Return how far paths that begin with n states have been followed, of `WALK_FIELDS`."""
    found = np.zeros(len(states), WALK_FIELDS)
    found["s"] = states["s"]
    return found


def held_share(states: Records, around: Records) -> Array:
    """Return the share of each tile's spines that grip the rock, φ − ψ, shape (n, 3).

    ``around``: records of `AROUND_FIELDS` with φ, the share on the rock; ``states``: records of
    `STATE_FIELDS` with ψ, the share that was pulled off.
    """
    return engaged_share(1.0 - around["share"] + states["off"], 1.0)
