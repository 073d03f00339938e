"""A hand closed on a hold: places of its tiles, and their loads per newton of tendon tension."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, BoundedStore, Indices
from hand_models.finger import CONTACT_KINDS, JOINT_STOPS, Contact, FingerModel, SettledFinger
from hand_models.hand.finger_frames import border_distances
from hand_models.hand.grasp import Grasp
from hand_models.hand.model import HandModel
from hand_models.hand.names import CONTACT_NAMES, FINGERS, FINGERTIP_FORCE, NAIL, NAIL_SHEAR
from hand_models.hand.seating import Seating
from hand_models.parameters import FITTED_SURFACE
from hand_models.rock import Hold
from hand_models.tendon import shear_stiffness
from hand_models.tile import HalfPlane, Surface
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["HandPostures", "SettledHand", "SettledPalm", "SettledTile"]


class HandPostures(NamedTuple):
    """Postures and contacts of each finger in `FINGERS`, proximal phalanx first: shape (4, 3).

    Attributes
    ----------
    angles : ndarray
        θ, angle of each phalanx from x toward z of its finger's F [rad].
    joints : ndarray of complex
        x + i z of each phalanx's joint in the finger frame F [m].
    alongs, rises, tilts, engagement : ndarray
        Contact of each phalanx: distance from the joint [m], height above the tile's face [m],
        angle of its force from the phalanx's normal [rad], share of the tile's spines on the rock.
    kinds, stops : ndarray of int8
        Codes: indices into `CONTACT_NAMES`, and into `hand_models.finger.JOINT_STOPS`.
    across : ndarray
        Distance of each contact from its finger's plane [m].
    bearing_shares : ndarray
        Share of what balances its joint that each contact bears (`Contact`).
    """

    angles: Array
    joints: NDArray[np.complex128]
    alongs: Array
    rises: Array
    tilts: Array
    engagement: Array
    kinds: NDArray[np.int8]
    stops: NDArray[np.int8]
    across: Array
    bearing_shares: Array

    def fingers(self, model: FingerModel) -> tuple[SettledFinger, ...]:
        """Return the four fingers in the order of `FINGERS`; ``model``: numbers of a finger."""
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
                        *(share, across, bearing),
                    )
                    for angle, joint, along, rise, tilt, share, kind, stop, across, bearing in zip(
                        *finger, strict=True
                    )
                ),
            )
            for finger in zip(*(numbers.tolist() for numbers in self), strict=True)
        )


class SettledTile(NamedTuple):
    """Name and contact state of one finger tile.

    Attributes
    ----------
    finger : str
        One of `FINGERS`.
    phalanx : str
        ``base``, ``proximal``, ``middle``, ``distal``, or ``nail`` in a fingernail grasp.
    contact : {'face', 'edge', 'frame', 'nail', 'slipped', 'none'}
        Part on the rock; ``frame``: the bare phalanx beside it; ``slipped``: it drags on.
    """

    finger: str
    phalanx: str
    contact: str


class SettledPalm(NamedTuple):
    """The palm on its rock: engaged tiles and their strength.

    Attributes
    ----------
    gaps : ndarray, shape (8,)
        Distance from each tile to the rock along z of the hand frame H, infinite where there is
        none [m].
    engaged : tuple of int
        Indices of the tiles with rock within their spines' travel.
    engagement : tuple of float
        Spine engagement φ of each engaged tile (`engaged_share`).
    centre : ndarray, shape (3,)
        Mean place of the engaged tiles in H, weighted by φ, where the palm's shear and pressing
        act [m]; the origin if no tile is engaged.
    shear_limit : float
        Largest shear, along −x of H on the rock: load sharing of whole tiles, averaged over
        `layers` [N].
    pressing_limit : float
        Largest pressing along +z of H, the sum over the engaged tiles, each by its φ [N].
    """

    gaps: Array
    engaged: tuple[int, ...]
    engagement: tuple[float, ...]
    centre: Array
    shear_limit: float
    pressing_limit: float

    @property
    def nearest_gap(self) -> float:
        """Gap of the engaged tile that is nearest to the rock; infinite without one [m]."""
        return float(self.gaps[list(self.engaged)].min(initial=np.inf))

    @property
    def layers(self) -> list[tuple[float, tuple[int, ...]]]:
        """Palm as nested sets of whole tiles: pairs (weight, indices of the tiles).

        Load sharing is known for whole tiles. For partly engaged tiles it is averaged over these
        sets (the Choquet integral over φ): exact if every φ is 1, and continuous where a φ becomes
        zero.
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
    """A hand closed on a hold: place of every tile, and its load per newton of tendon tension.

    Attributes
    ----------
    hand : HandModel
    hold : Hold
    grasp : Grasp
    surface : Surface
    closing_tension : float
        Tension of each tendon at closing [N].
    seating : Seating
        Pose of the hold in the hand.
    postures : HandPostures
        Postures of the fingers, in the order of `FINGERS`.
    tiles : tuple of SettledTile, length n
        The 14 finger tiles, finger by finger, from the base outward; in a fingernail grasp each
        finger's nail follows its tiles.
    finger_of : ndarray of int, shape (n,)
        Index of each tile's finger.
    positions : ndarray, shape (n, 3)
        Place of each tile's contact in the hand frame H [m].
    axes : ndarray, shape (n, 3, 3)
        Rows: unit force on the rock of shear, of normal and of lateral load, in H.
    loads : ndarray, shape (n, 2, 2)
        Shear and normal load (second axis), each at zero tension [N] and per newton of tension. For
        a nail the normal load is P, across it; its shear A, along it, is passive.
    engagement : ndarray, shape (n,)
        Spine engagement φ of each tile (`engaged_share`): in (0, 1] for contacts ``face`` and
        ``edge``, else 0. A tile has φ times the shear of a whole tile, φ times its strength, and a
        part of its finger's lateral reaction in proportion to φ. See also `limit_shares`.
    nail_angles : ndarray, shape (4,)
        Angle of each finger's nail; fully retracted if it does not hook [rad].
    nail_normals : ndarray, shape (4, 3)
        Unit vector out of the rock at each nail's hook, in H; zero if the nail does not hook.
    nail_rows : tuple of (ndarray, ndarray)
        ``H`` and ``h`` of the `Cling` of each nail that hooks, in the order of the tiles.
    stops : tuple of (int, int, ndarray)
        For each joint at a limit, of fingers with a contact: index of the finger, index of the
        joint, and the torque against its stop at zero tension [N·m] and per newton [m].
    palm : SettledPalm
    closed : SettledHand or None
        The hand as it closed, if tiles have slipped since (`fixed_wrist.slipped_hand`).
    sets : BoundedStore of float to WrenchSpace
        Cache of the hand's last wrench spaces (`fixed_wrist`), by the largest tension [N].
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
    closed: SettledHand | None = None
    sets: BoundedStore[float, WrenchSpace] = field(
        default_factory=lambda: BoundedStore("sets of hands", most=4), init=False, repr=False
    )

    @property
    def as_closed(self) -> SettledHand:
        """The hand before any of its tiles slipped."""
        return self if self.closed is None else self.closed

    @property
    def fingers(self) -> tuple[SettledFinger, ...]:
        """Posture of each finger, in the order of `FINGERS`."""
        return self.postures.fingers(self.hand.finger)

    @property
    def closures(self) -> tuple[str, ...]:
        """Closure of each finger, in the order of `FINGERS`.

        ``laid``: the tiles of all three phalanges on the rock; ``hooked``: some of them;
        ``wedged``: only bare phalanges touch; ``curled``: no contact, tendon and springs in
        balance; ``stopped``: no contact, all joints at their limits; ``straight``: to cling with
        the nail.
        """
        if self.grasp.fingernail:
            return ("straight",) * len(FINGERS)
        none, balance = CONTACT_KINDS.index("none"), JOINT_STOPS.index("balance")
        postures, words = self.postures, []
        numbers = postures.engagement, postures.kinds, postures.stops
        for shares, kinds, stops in zip(*(each.tolist() for each in numbers), strict=True):
            if any(shares):
                words.append("laid" if all(shares) else "hooked")
            elif any(kind != none for kind in kinds):
                words.append("wedged")
            else:
                words.append("curled" if balance in stops else "stopped")
        return tuple(words)

    @property
    def touching(self) -> Array:
        """True for tiles that are on rock (contact ``face`` or ``edge``), shape (n,)."""
        return np.array([tile.contact in ("face", "edge") for tile in self.tiles])

    @property
    def lateral_shares(self) -> Array:
        """Share of its finger's lateral reaction that each tile carries, shape (n,).

        The tile's spine engagement φ over the sum of φ of the finger's tiles.
        """
        sums = self._whole_tiles
        return np.asarray(self.engagement / np.where(sums > 0.0, sums, 1.0)[self.finger_of])

    @property
    def limit_shares(self) -> Array:
        """Share of a whole tile's strength that limits each tile's load, shape (n,).

        φ from φ₀ on, the hand's ``least_share``; below that φ + (φ₀ − φ)² / (2 φ₀), and zero at φ =
        0. A tile's load goes to zero with φ but its limit does not, so that a tile that loses its
        spines limits the hand less and less.
        """
        least, share = self.hand.least_share, self.engagement
        more = np.maximum(least - share, 0.0) ** 2 / (2.0 * least)
        return np.where(share > 0.0, share + more, 0.0)

    @property
    def drag_allowances(self) -> Array:
        """Force beyond friction by which each tile may be dragged backwards, shape (n,) [N].

        Shear strength times (`limit_shares` − φ): zero for φ ≥ φ₀.
        """
        return self.surface.shear_limit * (self.limit_shares - self.engagement)

    @property
    def lateral_limits(self) -> Array:
        """Lateral strength of each finger, the sum over its tiles by engagement, shape (4,) [N]."""
        return self.surface.lateral_limit * self._whole_tiles

    @property
    def _whole_tiles(self) -> Array:
        """Number of whole tiles that each finger's spines on rock make, Σ φ, shape (4,)."""
        return np.bincount(self.finger_of, self.engagement, len(FINGERS)).astype(float)

    @property
    def stiffness_ratio(self) -> float:
        """Contact stiffness of tiles on this surface over that of the calibration.

        It counts where the wrist moves; on closing tiles are dragged as calibrated.
        """
        return 1.0 if self.surface.name == FITTED_SURFACE else self.hand.rock_stiffness_ratio

    @property
    def palm_shear_stiffness(self) -> float:
        """Stiffness of the palm's shear toward −x [N/m].

        Load sharing of whole tiles, averaged over the palm's layers; zero if no tile is engaged.
        """
        hand, found = self.hand, 0.0
        for share, tiles in self.palm.layers:
            contacts = tuple(hand.palm_contact[i] for i in tiles)
            rubs = hand.palm_friction, hand.palm_own_friction
            found += share * shear_stiffness(contacts, hand.palm_spring, *rubs)
        return found

    @property
    def nails(self) -> Array:
        """True for nails that hook, shape (n,)."""
        return np.array([tile.contact == NAIL for tile in self.tiles])

    @property
    def holding(self) -> Array:
        """True for tiles that are on rock and for nails that hook, shape (n,)."""
        return np.logical_or(self.touching, self.nails)

    @property
    def rock_ends(self) -> tuple[float, ...]:
        """Distance from each finger's joint to the hold's border in the finger's plane [m].

        Infinite where the hold has no border or the plane does not cut it.
        """
        return self.distances_to(self.hold.border)

    def distances_to(self, border: Array) -> tuple[float, ...]:
        """Return distances as `rock_ends`, to a border in the hold's frame, shape (n, 2, 3) [m]."""
        if not len(border):
            return (math.inf,) * len(FINGERS)
        frames = self.hand.frames(self.grasp.outer_rotation)
        return border_distances(frames, self.seating.pose.apply(border))

    def nail_limits(self, tile: int) -> tuple[HalfPlane, HalfPlane]:
        """Return two limits of a nail's force: toward its finger's base, and into the rock.

        Parameters
        ----------
        tile : int
            Index of the nail in ``tiles``.

        Returns
        -------
        tuple of HalfPlane
            Limits ``nail_shear``, with capacity `Structure.finger_shear`, and
            ``fingertip_force`` [N].
        """
        structure, into = self.hand.structure, np.array([0.0, 0.0, 1.0])
        base = -self.hand.frames(self.grasp.outer_rotation)[self.finger_of[tile]].along
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
        """Return shear, normal and lateral load of each finger tile for given tendon tensions.

        Parameters
        ----------
        tensions : ndarray, shape (4,)
            Tensions of the tendons [N].
        laterals : ndarray, shape (4,), optional
            Lateral reaction of each finger on the rock [N]; zero by default.
        axials : ndarray, shape (4,), optional
            A, axial force of each finger's nail [N]; zero by default.

        Returns
        -------
        ndarray, shape (n, 3)
            Loads of each tile [N]; c_sys + f c_act of Eq. 14.
        """
        f = np.asarray(tensions, dtype=float)[self.finger_of]
        y = np.zeros(len(FINGERS)) if laterals is None else np.asarray(laterals, dtype=float)
        planar = self.loads[..., 0] + self.loads[..., 1] * f[:, None]
        if axials is not None:
            planar[:, 0] += np.where(self.nails, np.asarray(axials)[self.finger_of], 0.0)
        return np.column_stack([planar, self.lateral_shares * y[self.finger_of]])
