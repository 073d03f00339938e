"""A hand closed on a hold: where its tiles are, and what tension loads them with."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, BoundedStore, Indices
from hand_models.finger import CONTACT_KINDS, JOINT_STOPS, Contact, FingerModel, SettledFinger
from hand_models.hand.grasp import Grasp
from hand_models.hand.model import HandModel
from hand_models.hand.names import CONTACT_NAMES, FINGERS, FINGERTIP_FORCE, NAIL, NAIL_SHEAR
from hand_models.hand.seating import Seating
from hand_models.rock import Hold
from hand_models.tile import HalfPlane, Surface
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["HandPostures", "SettledHand", "SettledPalm", "SettledTile"]


class HandPostures(NamedTuple):
    """Postures of four fingers, and their contacts; arrays have shape (4, 3).

    Attributes
    ----------
    angles : ndarray
        θ of each phalanx [rad].
    joints : ndarray of complex
        x + i z of each joint in F [m].
    alongs, rises, tilts, engagement : ndarray
        Of each contact: along its phalanx from the joint, above the tile's face [m], from the
        phalanx's normal [rad], and the share of the tile's spines on the rock.
    kinds, stops : ndarray of int8
        Codes of `CONTACT_NAMES` and `hand_models.finger.JOINT_STOPS`.
    """

    angles: Array
    joints: NDArray[np.complex128]
    alongs: Array
    rises: Array
    tilts: Array
    engagement: Array
    kinds: NDArray[np.int8]
    stops: NDArray[np.int8]

    def fingers(self, model: FingerModel) -> tuple[SettledFinger, ...]:
        """Return the fingers one by one."""
        return tuple(
            SettledFinger(
                model,
                tuple(
                    Contact(
                        angle,
                        (joint.real, joint.imag),
                        along,
                        CONTACT_NAMES[kind],
                        JOINT_STOPS[stop],
                        rise,
                        tilt,
                        share,
                    )
                    for angle, joint, along, rise, tilt, share, kind, stop in zip(
                        *finger, strict=True
                    )
                ),
            )
            for finger in zip(*(numbers.tolist() for numbers in self), strict=True)
        )


class SettledTile(NamedTuple):
    """One finger tile's place among the hand's rows and columns.

    Attributes
    ----------
    finger : str
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``; ``nail`` where the hand clings with it.
    contact : {'face', 'edge', 'frame', 'nail', 'none'}
        What of it touches the rock; ``frame`` if its phalanx only rests beside the tile.
    """

    finger: str
    phalanx: str
    contact: str


class SettledPalm(NamedTuple):
    """The palm on its rock.

    Attributes
    ----------
    gaps : ndarray, shape (8,)
        From each tile to the rock along z, infinite where there is none [m].
    engaged : tuple of int
        Tiles with spines on the rock: it is within their travel.
    engagement : tuple of float
        Share φ of the spines of each of these that are on the rock (`engaged_share`).
    centre : ndarray, shape (3,)
        Of the engaged tiles, each by its share, where shear and pressing act [m]; the origin if
        none are engaged.
    shear_limit : float
        Along −x of H on the rock, by load sharing of whole tiles, as the mean over `layers` [N].
    pressing_limit : float
        Along +z, of each tile its share [N].
    """

    gaps: Array
    engaged: tuple[int, ...]
    engagement: tuple[float, ...]
    centre: Array
    shear_limit: float
    pressing_limit: float

    @property
    def layers(self) -> list[tuple[float, tuple[int, ...]]]:
        """Return the palm as sets of whole tiles, one in another, each with its weight.

        What whole tiles share among them becomes that of tiles engaged in part as the mean over
        these sets (the Choquet integral over the shares): the same where all shares are one, and
        without a jump where one of them becomes zero.
        """
        order = sorted(zip(self.engagement, self.engaged, strict=True), key=lambda each: -each[0])
        shares = [share for share, _ in order] + [0.0]
        return [
            (share - later, tuple(sorted(tile for _, tile in order[: i + 1])))
            for i, (share, later) in enumerate(itertools.pairwise(shares))
            if share > later
        ]


@dataclass(frozen=True, eq=False)
class SettledHand:
    """A hand closed on a hold: where every tile is and what each newton of tension loads.

    Attributes
    ----------
    hand : HandModel
    hold : Hold
    grasp : Grasp
    surface : Surface
    closing_tension : float
        [N]
    seating : Seating
    postures : HandPostures
        Of the fingers, in the order of `FINGERS`.
    tiles : tuple of SettledTile
        The 14 finger tiles, finger by finger, from the base outward; after each finger's, where the
        hand clings, its nail.
    finger_of : ndarray of int, shape (n,)
        Index of each tile's finger.
    positions : ndarray, shape (n, 3)
        Of each tile's contact in H [m].
    axes : ndarray, shape (n, 3, 3)
        Rows: the unit force on the rock of shear, of normal and of lateral load, in H.
    loads : ndarray, shape (n, 2, 2)
        Shear and normal load, each at zero tension [N] and per newton of tension. A nail's normal
        load is P across it; its shear A, along it, is passive.
    engagement : ndarray, shape (n,)
        Share φ of each tile's spines that are on the rock (`engaged_share`): above 0, at most 1,
        where its contact is ``face`` or ``edge``, 0 of all others and of nails. A tile has φ times
        the shear that its tendon would give the whole of it, holds φ times as much, and carries
        its finger's lateral reaction in proportion to φ. See `limit_shares`, too.
    nail_angles : ndarray, shape (4,)
        How far each finger's nail has turned; all the way where it does not hook [rad].
    nail_normals : ndarray, shape (4, 3)
        Out of the rock where each finger's nail hooks, in H; zero where none does.
    nail_rows : tuple of (ndarray, ndarray)
        H and h of `Fingernail.rows` of each nail that hooks, in the order of the tiles.
    stops : tuple of (int, int, ndarray)
        Finger, joint and the torque on its stop, affine in tension, of joints at their limits.
    palm : SettledPalm
    sets : BoundedStore of float to WrenchSpace
        What `fixed_wrist.wrench_spaces` found for a largest tension [N], the last few.
    """

    hand: HandModel
    hold: Hold
    grasp: Grasp
    surface: Surface
    closing_tension: float
    seating: Seating
    postures: HandPostures
    tiles: tuple[SettledTile, ...]
    finger_of: Indices
    positions: Array
    axes: Array
    loads: Array
    engagement: Array
    nail_angles: Array
    nail_normals: Array
    nail_rows: tuple[tuple[Array, Array], ...]
    stops: tuple[tuple[int, int, Array], ...]
    palm: SettledPalm
    sets: BoundedStore[float, WrenchSpace] = field(
        default_factory=lambda: BoundedStore("sets of hands", most=4), init=False, repr=False
    )

    @cached_property
    def fingers(self) -> tuple[SettledFinger, ...]:
        """The fingers, in the order of `FINGERS`."""
        return self.postures.fingers(self.hand.finger)

    @cached_property
    def closures(self) -> tuple[str, ...]:
        """Closure of each finger.

        Laid with all of its tiles on the rock; hooked with some of them; wedged with bare phalanges
        or its tip only; curled in the air between its springs and its tendon; stopped there with
        all joints at limits; or held straight to cling with its nail.
        """
        if self.grasp.fingernail:
            return ("straight",) * len(FINGERS)
        none, balance = CONTACT_KINDS.index("none"), JOINT_STOPS.index("balance")
        postures = self.postures
        words = []
        for shares, kinds, stops in zip(
            postures.engagement.tolist(),
            postures.kinds.tolist(),
            postures.stops.tolist(),
            strict=True,
        ):
            if any(shares):
                words.append("laid" if all(shares) else "hooked")
            elif any(kind != none for kind in kinds):
                words.append("wedged")
            else:
                words.append("curled" if balance in stops else "stopped")
        return tuple(words)

    @cached_property
    def touching(self) -> Array:
        """True for tiles that have rock under them, shape (n,)."""
        return np.array([tile.contact in ("face", "edge") for tile in self.tiles])

    @cached_property
    def lateral_shares(self) -> Array:
        """Share of its finger's lateral reaction that each tile carries, as its φ, shape (n,)."""
        sums = np.where(self._whole_tiles > 0.0, self._whole_tiles, 1.0)
        return np.asarray(self.engagement / sums[self.finger_of])

    @cached_property
    def limit_shares(self) -> Array:
        """Part of a whole tile's strength that limits each tile's load, shape (n,).

        φ, and below φ₀, the hand's ``least_share``, φ + (φ₀ − φ)² / (2 φ₀): a tile's load goes to
        zero with φ, its limit does not, so that a tile with fewer and fewer spines on the rock
        limits the hand less and less. Zero where it has none.
        """
        least, share = self.hand.least_share, self.engagement
        more = np.maximum(least - share, 0.0) ** 2 / (2.0 * least)
        return np.where(share > 0.0, share + more, 0.0)

    @cached_property
    def drag_allowances(self) -> Array:
        """Force beyond friction by which each tile may be dragged backwards, shape (n,) [N].

        Shear strength times what its part of `limit_shares` is more than φ: zero from φ₀ on.
        """
        return self.surface.shear_limit * (self.limit_shares - self.engagement)

    @cached_property
    def lateral_limits(self) -> Array:
        """Lateral force that the tiles of each finger hold together, shape (4,) [N]."""
        return self.surface.lateral_limit * self._whole_tiles

    @cached_property
    def _whole_tiles(self) -> Array:
        """Number of whole tiles that each finger's spines on rock make, Σ φ, shape (4,)."""
        sums = np.bincount(self.finger_of, weights=self.engagement, minlength=len(FINGERS))
        return np.asarray(sums, dtype=float)

    @cached_property
    def nails(self) -> Array:
        """True for tiles that are nails that hook, shape (n,)."""
        return np.array([tile.contact == NAIL for tile in self.tiles])

    @cached_property
    def holding(self) -> Array:
        """True for tiles and nails that are on rock that they hold, shape (n,)."""
        return np.logical_or(self.touching, self.nails)

    @cached_property
    def rock_ends(self) -> tuple[float, ...]:
        """Distance from each finger's joint to the rock's end in its plane, or infinity [m]."""
        border = self.hold.border
        if not len(border):
            return (math.inf,) * len(FINGERS)
        ends = self.seating.pose.apply(border)
        found = []
        for frame in self.hand.frames(self.grasp.outer_rotation):
            off = (ends - frame.joint) @ frame.across
            cut = (off[:, 0] < 0.0) != (off[:, 1] < 0.0)
            (p, q), (a, b) = off[cut].T, (ends[cut] - frame.joint).transpose(1, 0, 2)
            points = (p[:, None] * b - q[:, None] * a) / (p - q)[:, None]
            found.append(float(np.linalg.norm(points, axis=1).min(initial=math.inf)))
        return tuple(found)

    def nail_limits(self, tile: int) -> tuple[HalfPlane, HalfPlane]:
        """Return the limits of a nail's force, toward its finger's base and into the rock."""
        structure = self.hand.structure
        base = -self.hand.frames(self.grasp.outer_rotation)[self.finger_of[tile]].along
        into = np.array([0.0, 0.0, 1.0])
        (shear, normal), (pulled, pressed) = (
            (self.axes[tile, :2] @ direction).tolist() for direction in (base, into)
        )
        return (
            HalfPlane(NAIL_SHEAR, shear, normal, 0.0, structure.finger_shear),
            HalfPlane(FINGERTIP_FORCE, pulled, pressed, 0.0, structure.fingertip_force),
        )

    def tile_loads(
        self, tensions: Array, laterals: Array | None = None, axials: Array | None = None
    ) -> Array:
        """Return shear, normal and lateral load of each finger tile.

        Parameters
        ----------
        tensions : ndarray, shape (4,)
            Of the tendons [N].
        laterals : ndarray, shape (4,), optional
            Lateral reaction of each finger on the rock [N].
        axials : ndarray, shape (4,), optional
            A of each finger's nail [N].

        Returns
        -------
        ndarray, shape (n, 3)
            [N]; c_sys + f c_act of Eq. 14.
        """
        f = np.asarray(tensions, dtype=float)[self.finger_of]
        y = np.zeros(len(FINGERS)) if laterals is None else np.asarray(laterals, dtype=float)
        planar = self.loads[..., 0] + self.loads[..., 1] * f[:, None]
        if axials is not None:
            planar[:, 0] += np.where(self.nails, np.asarray(axials)[self.finger_of], 0.0)
        return np.column_stack([planar, self.lateral_shares * y[self.finger_of]])
