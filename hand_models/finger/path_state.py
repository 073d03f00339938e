"""Fingers on their paths as arrays: what moves them, their rock beside them, their state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger.model import PHALANGES, FingerModel
from hand_models.finger.phalanx_gaps import PhalanxShape, fan_out, nearest_points
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.sections import Complexes, Flags, Outlines, Section
from hand_models.tile import Surface, engaged_share

__all__ = [
    "JOINT_COUNT",
    "UNIT_MATRIX",
    "Around",
    "Codes",
    "Drive",
    "OpenFinger",
    "PathState",
    "choose",
    "held_share",
    "largest",
    "put",
    "take",
    "times",
]

JOINT_COUNT: Final = len(PHALANGES)

Codes = NDArray[np.int8]

Rows = TypeVar("Rows", bound=tuple[Any, ...])
"""A tuple of arrays with a row for each finger."""

SEEN_POSES: Final = np.concatenate(
    [np.zeros((1, JOINT_COUNT)), SETTINGS.derivative_turn * np.eye(JOINT_COUNT)]
)
"""Turns of the joints at which a finger is looked at: itself, and with each joint turned."""

LATER_PHALANGES: Final = np.triu(np.ones((JOINT_COUNT, JOINT_COUNT)))
"""1 at (i, j) where phalanx j turns joint i: its own and those beyond."""

UNIT_MATRIX: Final = np.eye(JOINT_COUNT)


class OpenFinger(NamedTuple):
    """A finger that is to close.

    Attributes
    ----------
    section : Section or None
        Rock in the finger's plane, the proximal joint at its origin.
    surface : Surface
        What the tiles hold.
    tension : float
        At which the tiles catch the rock [N].
    base_tile : bool
        Whether a base tile comes first on the tendon.
    """

    section: Section | None
    surface: Surface
    tension: float
    base_tile: bool = False


class Drive(NamedTuple):
    """Torques, drags and limits that move n fingers; SI units.

    Attributes
    ----------
    pull, drag : ndarray, shape (n, 3)
        M r, torque about each joint, and M τ, shear of each tile, per newton of tension.
    closing : ndarray, shape (n,)
        Tension at the end.
    depth : ndarray, shape (n, 3)
        Depth to which tiles are pressed in.
    limits : ndarray, shape (n, 5)
        `Surface.straight_law` and μ of the surfaces.
    torque : ndarray, shape (n,)
        Torque about the proximal joint at the closing tension.
    stiffness, preload, lower, upper : ndarray, shape (n, 3)
        Of the joints.
    """

    pull: Array
    drag: Array
    closing: Array
    depth: Array
    limits: Array
    torque: Array
    stiffness: Array
    preload: Array
    lower: Array
    upper: Array

    @classmethod
    def of(cls, model: FingerModel, closings: Sequence[OpenFinger]) -> Drive:
        """Gather what moves fingers of one model."""
        losses = np.array([model.losses(closing.base_tile) for closing in closings])
        closing = np.array([closing.tension for closing in closings])
        pull = losses * np.array(model.pulley_radii)
        surfaces = [closing.surface for closing in closings]
        limits = [(*surface.straight_law, surface.friction) for surface in surfaces]
        springs = (model.joint_stiffness, model.joint_preload, model.joint_lower, model.joint_upper)
        stiffness, preload, lower, upper = (np.tile(each, (len(closing), 1)) for each in springs)
        return cls(
            pull=pull,
            drag=losses * np.array(model.engagement),
            closing=closing,
            depth=closing[:, None] * np.array([model.depths(each.base_tile) for each in closings]),
            limits=np.array(limits),
            torque=pull[:, 0] * closing,
            stiffness=stiffness,
            preload=preload,
            lower=lower,
            upper=upper,
        )

    @property
    def end(self) -> Array:
        """Place of the ends of the fingers' paths along them; see `PathState` [N]."""
        return (1.0 + SETTINGS.catching_part) * self.closing


class Around(NamedTuple):
    """Fingers beside their rock, with derivatives in q, the last axis of those.

    Attributes
    ----------
    gap, share : ndarray, shape (n, 3)
        g_j [m] and φ_j.
    a, b : ndarray, shape (n, 3, 3)
        a_ij and b_ij: torques about joint i of unit forces at contact j [m].
    d_gap, d_share : ndarray, shape (n, 3, 3)
    d_a, d_b : ndarray, shape (n, 3, 3, 3)
    place, push : ndarray of complex, shape (n, 3)
        As of `Beside`.
    """

    gap: Array
    share: Array
    a: Array
    b: Array
    d_gap: Array
    d_share: Array
    d_a: Array
    d_b: Array
    place: Complexes
    push: Complexes

    @classmethod
    def of(cls, rock: Outlines, shape: PhalanxShape, drive: Drive, q: Array) -> Around:
        """Look at fingers turned by q."""
        turn = SETTINGS.derivative_turn
        near = nearest_points(rock, shape, q, drive.depth, turn)
        joints, u = fan_out(q + SEEN_POSES[:, None], shape.end)
        depth = np.broadcast_to(drive.depth, u.shape)
        beside = shape.beside(near.of_poses(len(SEEN_POSES)), joints, u, depth)
        # a phalanx that presses aside, with its end, has its spines beside the rock
        share = engaged_share(beside.tile_gap, shape.travel)
        share = engaged_share(1.0 - share * beside.push.imag, 1.0)
        # from joint i to contact j, in the axes of its force
        arms = (joints + beside.place * u)[..., None, :] - joints[..., None]
        arms = LATER_PHALANGES * arms * (beside.push * u).conj()[..., None, :]
        values = (beside.gap, share, -arms.real, -arms.imag)
        gap, share, a, b = (value[0] for value in values)
        d_gap, d_share, d_a, d_b = (
            np.moveaxis((value[1:] - value[:1]) / turn, 0, -1) for value in values
        )
        place, push = beside.place[0], beside.push[0]
        return cls(gap, share, a, b, d_gap, d_share, d_a, d_b, place, push)


class PathState(NamedTuple):
    """Fingers on their paths, a row each.

    Attributes
    ----------
    q : ndarray, shape (n, 3)
        [rad]
    s : ndarray, shape (n,)
        How far along they are: the tension, up to that of closing, and then, as far again as
        `catching_part` of it, how much of their drag tiles across gaps have [N].
    mode, stop, spines : ndarray of int, shape (n, 3)
        Off, on or held; +1 at an upper limit, −1 at a lower one, or 0; caught, pulled or lost (by
        `ContactCodes`).
    been : ndarray of bool, shape (n, 3)
        Whether phalanges have come to the rock since spines have caught.
    off : ndarray, shape (n, 3)
        ψ, share of spines that were pulled off and have not caught again.
    least : ndarray, shape (n, 3)
        m, the least gap since spines have caught or, if they were pulled off, then [m].
    normals : ndarray, shape (n, 3)
        [N]
    touches : ndarray, shape (n, 3)
        Tension at which each phalanx first came to the rock; NaN where it did not [N].
    damping, stride : ndarray, shape (n,)
        D [N·m/rad], and how far joints may turn at once [rad].
    step : ndarray, shape (n, 3)
        Turn of the last increment [rad].
    left : ndarray, shape (n, 3)
        Torque that should be left after it by its linearisation [N·m].
    """

    q: Array
    s: Array
    mode: Codes
    stop: Codes
    spines: Codes
    been: Flags
    off: Array
    least: Array
    normals: Array
    touches: Array
    damping: Array
    stride: Array
    step: Array
    left: Array

    @classmethod
    def at(cls, q: Array) -> PathState:
        """Return fingers turned by q that begin to close."""
        n = len(q)
        return cls(
            q=q,
            s=np.zeros(n),
            mode=np.full(q.shape, CONTACT_CODES.off, dtype=np.int8),
            stop=np.zeros(q.shape, dtype=np.int8),
            spines=np.full(q.shape, CONTACT_CODES.caught, dtype=np.int8),
            been=np.zeros(q.shape, dtype=bool),
            off=np.zeros(q.shape),
            least=np.full(q.shape, np.inf),
            normals=np.zeros(q.shape),
            touches=np.full(q.shape, np.nan),
            damping=np.zeros(n),
            stride=np.full(n, SETTINGS.first_stride),
            step=np.zeros(q.shape),
            left=np.zeros(q.shape),
        )


def held_share(state: PathState, around: Around) -> Array:
    """Return the share of each tile's spines that hold on the rock, φ less ψ, shape (n, 3)."""
    return engaged_share(1.0 - around.share + state.off, 1.0)


def take(rows: Rows, fingers: Indices | Flags) -> Rows:
    """Return some fingers of a tuple of arrays with a row each."""
    return type(rows)(*(values[fingers] for values in rows))


def put(rows: Rows, fingers: Indices, own: Rows) -> None:
    """Set some fingers."""
    for values, its in zip(rows, own, strict=True):
        values[fingers] = its


def choose(chosen: Flags, those: Rows, others: Rows) -> Rows:
    """Return those for fingers that are chosen, others for the rest."""
    if not chosen.any():
        return others
    return type(those)(
        *(
            np.where(chosen.reshape(-1, *[1] * (this.ndim - 1)), this, other)
            for this, other in zip(those, others, strict=True)
        )
    )


def times(A: Array, x: Array) -> Array:
    """Return A x of each finger."""
    return np.asarray((A @ x[..., None])[..., 0])


def largest(values: Array) -> Flags:
    """Return which value of each finger is the largest, if that is above zero."""
    most = values.max(axis=1, keepdims=True)
    return np.asarray((np.arange(JOINT_COUNT) == values.argmax(axis=1)[:, None]) & (most > 0.0))
