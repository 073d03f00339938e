"""State of closing fingers, their drive and the rock around them: arrays with a row per finger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.finger.model import PHALANGES, FingerModel
from hand_models.finger.phalanx_gaps import PhalanxShape, fan_out, nearest_points
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.sections import Complexes, FingerRock, Flags, Outlines
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
"""Joint turns for finite differences: none, and each joint in turn by a small step [rad]."""

LATER_PHALANGES: Final = np.triu(np.ones((JOINT_COUNT, JOINT_COUNT)))
"""1 at (i, j) where a force on phalanx j has a torque about joint i: j ≥ i."""

UNIT_MATRIX: Final = np.eye(JOINT_COUNT)


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


class Drive(NamedTuple):
    """Tendon torques, springs, joint limits and tile strengths of n closing fingers.

    Attributes
    ----------
    pull, drag : ndarray, shape (n, 3)
        M r, the tendon's torque about each joint per newton of tension [m]; M τ, the shear of each
        tile per newton of tension.
    closing : ndarray, shape (n,)
        Closing tension [N].
    depth : ndarray, shape (n, 3)
        Depth to which the closing tension presses tiles into their beds of springs [m].
    limits : ndarray, shape (n, 5)
        Strength of each finger's surface: f_max [N], f_min [N], φ_max [rad], exponent p and
        friction μ.
    torque : ndarray, shape (n,)
        The tendon's torque about the proximal joint at the closing tension [N·m].
    stiffness, preload, lower, upper : ndarray, shape (n, 3)
        Spring stiffness [N·m/rad], spring preload [N·m] and angle limits [rad] of the joints.
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
        """Return the drive of fingers of one model.

        Parameters
        ----------
        model : FingerModel
        closings : sequence of OpenFinger, length n
            The fingers' surfaces and closing tensions.

        Returns
        -------
        Drive
            Arrays with a row for each finger, in the order of ``closings``.
        """
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
        """Path parameter s (see `PathState`) at the end of each finger's path, shape (n,) [N]."""
        return (1.0 + SETTINGS.catching_part) * self.closing


class Around(NamedTuple):
    """Gaps, engagement and lever arms of n fingers beside their rock, with derivatives in q.

    q are the three joint angles; the last axis of a derivative counts them.

    Attributes
    ----------
    gap, share : ndarray, shape (n, 3)
        g_j, gap of phalanx j to the rock [m], and φ_j, share of its tile's spines on the rock.
    a, b : ndarray, shape (n, 3, 3)
        Lever arms [m]: the torque about joint i of contact j is T_j a_ij − N_j b_ij, for the shear
        T_j and the normal load N_j.
    d_gap, d_share : ndarray, shape (n, 3, 3)
        Derivatives of ``gap`` [m/rad] and ``share`` [1/rad].
    d_a, d_b : ndarray, shape (n, 3, 3, 3)
        Derivatives of ``a`` and ``b`` [m/rad].
    place, push : ndarray of complex, shape (n, 3)
        Place of each contact's force [m] and its unit vector toward the rock, in the phalanx's
        axes: real part along it, imaginary part above it.
    across : ndarray, shape (n, 3)
        Middle of the engaged part of each tile: its distance from the finger's plane [m].
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
    across: Array

    @classmethod
    def of(cls, rock: Outlines, shape: PhalanxShape, drive: Drive, q: Array) -> Around:
        """Return gaps, engagement and lever arms at joint angles, and their finite differences.

        Parameters
        ----------
        rock : Outlines
            Rock in the plane of each of the n fingers.
        shape : PhalanxShape
        drive : Drive
            Supplies the depths to which tiles are pressed in.
        q : ndarray, shape (n, 3)
            Joint angles [rad].
        """
        turn = SETTINGS.derivative_turn
        near = nearest_points(rock, shape, q, drive.depth, turn)
        joints, u = fan_out(q + SEEN_POSES[:, None], shape.end)
        depth = np.broadcast_to(drive.depth, u.shape)
        beside = shape.beside(near.of_poses(len(SEEN_POSES)), joints, u, depth)
        # in each of the strips across a tile its spines reach the rock or not
        strips = _strip_gaps(rock, shape, joints, u)
        parts = engaged_share(beside.tile_gap[..., None] + strips, shape.travel)
        share = parts.mean(axis=-1)
        middle = np.einsum("njk,nk->nj", parts[0], rock.across)
        middle = middle / np.maximum(parts[0].sum(axis=-1), BASE_TOLERANCES.rounding)
        # a phalanx that presses aside, with its end, has its spines beside the rock
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
        return cls(gap, share, a, b, d_gap, d_share, d_a, d_b, place, push, middle)


def _strip_gaps(rock: Outlines, shape: PhalanxShape, joints: Complexes, u: Complexes) -> Array:
    """Return how much farther from tiles the rock of each strip is than the envelope of all.

    Parameters
    ----------
    rock : Outlines
        Rock in the plane of each of the n fingers, with k strips.
    shape : PhalanxShape
    joints, u : ndarray of complex, shape (m, n, 3)
        x + i z of each phalanx's joint [m], and the unit vector along the phalanx, in m poses near
        to each other.

    Returns
    -------
    ndarray, shape (m, n, 3, k)
        Not negative [m].
    """
    fingers, k = np.arange(len(rock.places))[:, None, None], rock.behind.shape[-1]
    if k == 1:
        return np.zeros((*u.shape, 1))

    def from_tile(places: Complexes, joints: Complexes, u: Complexes) -> Array:
        seen = (places - joints[..., None]) * u.conj()[..., None]
        return np.abs(seen - (np.clip(seen.real, shape.near, shape.far) + 1j * shape.lift))

    # half a millimetre apart: what is under the tile, and some millimetres on both sides
    near = from_tile(rock.places[:, None], joints[0], u[0])
    count = min(64, near.shape[-1])
    chosen = np.argpartition(near, count - 1, axis=-1)[..., :count]
    away = from_tile(rock.places[fingers, chosen], joints, u)
    least = (away[..., None] + rock.behind[fingers, chosen]).min(axis=-2)
    return np.asarray(least - away.min(axis=-1, keepdims=True))


class PathState(NamedTuple):
    """State of n fingers on their closing paths.

    Attributes
    ----------
    q : ndarray, shape (n, 3)
        Joint angles [rad].
    s : ndarray, shape (n,)
        Path parameter [N]: the tension, from 0 to the closing tension; beyond that, up to
        ``catching_part`` of the closing tension more, the drag on spines across gaps grows to full.
    mode, stop, spines : ndarray of int, shape (n, 3)
        Contact of each phalanx: off, on or held. Stop of each joint: +1 at the upper limit, −1 at
        the lower, else 0. Spines of each tile: caught, pulled or lost. Codes of `ContactCodes`.
    been : ndarray of bool, shape (n, 3)
        Whether the phalanx has touched the rock since its spines caught.
    off : ndarray, shape (n, 3)
        ψ, share of the tile's spines that were pulled off and have not caught again.
    least : ndarray, shape (n, 3)
        m, least gap since the spines caught; after a pull-off, the gap at which it happened [m].
    normals : ndarray, shape (n, 3)
        Normal load of each contact [N].
    touches : ndarray, shape (n, 3)
        Value of ``s`` at which the phalanx first touched the rock [N]; NaN if it never did.
    damping, stride : ndarray, shape (n,)
        Damping D of the joints [N·m/rad]; largest turn of a joint in the next increment [rad].
    step : ndarray, shape (n, 3)
        Turn of the joints in the last increment [rad].
    left : ndarray, shape (n, 3)
        Torque residual that the linearisation predicts after the last increment [N·m].
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
        """Return the start of closing: no tension, no contact, all spines ready to catch.

        Parameters
        ----------
        q : ndarray, shape (n, 3)
            Joint angles of the open fingers [rad].
        """
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
    """Return the share of each tile's spines that grip the rock, φ − ψ, shape (n, 3).

    φ: share on the rock (`Around.share`); ψ: share that was pulled off (`PathState.off`).
    """
    return engaged_share(1.0 - around.share + state.off, 1.0)


def take(rows: Rows, fingers: Indices | Flags) -> Rows:
    """Return some fingers' rows of every array in a tuple of arrays.

    Parameters
    ----------
    rows : tuple of ndarray
        Arrays with a row for each finger.
    fingers : ndarray of int or bool
        Indices of the fingers, or a mask.

    Returns
    -------
    tuple of ndarray
        Of the same type as ``rows``.
    """
    return type(rows)(*(values[fingers] for values in rows))


def put(rows: Rows, fingers: Indices, own: Rows) -> None:
    """Overwrite in place the rows of some fingers in each array of ``rows`` by those of ``own``."""
    for values, its in zip(rows, own, strict=True):
        values[fingers] = its


def choose(chosen: Flags, those: Rows, others: Rows) -> Rows:
    """Return the rows of ``those`` where ``chosen`` is true and the rows of ``others`` elsewhere.

    Parameters
    ----------
    chosen : ndarray of bool, shape (n,)
    those, others : tuple of ndarray
        Same type; every array has n rows.
    """
    if not chosen.any():
        return others
    return type(those)(
        *(
            np.where(chosen.reshape(-1, *[1] * (this.ndim - 1)), this, other)
            for this, other in zip(those, others, strict=True)
        )
    )


def times(A: Array, x: Array) -> Array:
    """Return the matrix–vector product A x of each finger: (n, i, j) times (n, j) is (n, i)."""
    return np.asarray((A @ x[..., None])[..., 0])


def largest(values: Array) -> Flags:
    """Return a mask (n, 3), true at each row's largest value, if that value is above zero."""
    most = values.max(axis=1, keepdims=True)
    return np.asarray((np.arange(JOINT_COUNT) == values.argmax(axis=1)[:, None]) & (most > 0.0))
