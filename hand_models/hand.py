"""SpinyHand: four fingers and a palm, placed in the hand frame H and closed on a hold.

H has its origin at the centre of the palm's tile grid, on the tiles' surface: x along the two inner
fingers, z out of the palm into the rock, y = z × x. The two outer fingers turn on their bases by
``outer_rotation``, outward through ±y: 0 puts all four alike, π opposes them (a pinch).

A *base tile* sits on the rotating base of each outer finger, under the same tendon. It cannot turn
toward the rock, so like a palm tile it engages where rock is within the spines' travel of it; then
the tendon drags it as it drags the others, and it carries shear and its share of the lateral
reaction, but no normal load (``assumed``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from hand_models.actuation import TendonDrive
from hand_models.contact_states import ClosedFinger, cling, close
from hand_models.errors import InvalidInputError
from hand_models.finger import PHALANGES, FingerModel, SettledFinger
from hand_models.fingernail import Cling, Fingernail
from hand_models.frames import Array, Indices, Pose
from hand_models.holds import Hold
from hand_models.limit_pieces import HalfPlane
from hand_models.palm import PalmTendon, shear_capacity
from hand_models.parameters import ParameterTable, hand_table
from hand_models.seating import Seating, seat
from hand_models.sections import Section
from hand_models.settling import intrusion
from hand_models.spines import Surface
from hand_models.structure import Structure

__all__ = [
    "FINGERS",
    "FingerFrame",
    "Grasp",
    "Palm",
    "Seating",
    "SettledHand",
    "SpinyHand",
    "Tile",
    "spiny_hand",
]

FINGERS: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Order of every list of four tensions; left is +y of H."""

NAIL: Final = "nail"
"""The ultrashort phalanx at a fingertip, by name, and the contact of one that hooks."""

NAIL_SHEAR: Final = "nail_shear"
"""Name of the limit of a nail that pulls toward its finger's base."""

FINGERTIP_FORCE: Final = "fingertip_force"
"""Name of the limit of a distal phalanx, or a nail, that presses into the rock."""

OPPOSED: Final = 1e-6
"""How close to π an outer rotation counts as a pinch [rad]."""


@dataclass(frozen=True)
class Grasp:
    """How a hand takes a hold.

    Attributes
    ----------
    outer_rotation : float
        Of the outer fingers, in [0, π] [rad].
    closing_tension : float, optional
        Of each tendon at the moment the tiles caught the rock [N]; the parameter file's default.
    palm : bool
        Whether the palm may carry load.
    lateral : bool
        Whether engaged spines may resist sideways.
    fingernail : bool
        Whether the fingers stay straight and cling with their nails alone.
    """

    outer_rotation: float = 0.0
    closing_tension: float | None = None
    palm: bool = True
    lateral: bool = True
    fingernail: bool = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.outer_rotation <= math.pi + OPPOSED:
            raise InvalidInputError(
                f"must be in [0, pi] rad, got {self.outer_rotation:g}", field="outer_rotation"
            )
        tension = self.closing_tension
        if tension is not None and not (math.isfinite(tension) and tension > 0.0):
            raise InvalidInputError(f"must be above 0 N, got {tension:g}", field="closing_tension")

    @property
    def pinch(self) -> bool:
        """Whether the outer fingers oppose the inner ones."""
        return self.outer_rotation >= math.pi - OPPOSED


@dataclass(frozen=True)
class Tile:
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


@dataclass(frozen=True, eq=False)
class Palm:
    """The palm on its rock.

    Attributes
    ----------
    gaps : ndarray, shape (8,)
        From each tile to the rock along z, infinite where there is none [m].
    engaged : tuple of int
        Tiles with rock within the spines' travel.
    centre : ndarray, shape (3,)
        Of the engaged tiles, where shear and pressing act [m]; the origin if none are engaged.
    shear_limit : float
        Along −x of H on the rock, by load sharing [N].
    pressing_limit : float
        Along +z [N].
    """

    gaps: Array
    engaged: tuple[int, ...]
    centre: Array
    shear_limit: float
    pressing_limit: float


@dataclass(frozen=True, eq=False)
class SettledHand:
    """A hand closed on a hold: where every tile is and what each newton of tension loads.

    Attributes
    ----------
    hand : SpinyHand
    hold : Hold
    grasp : Grasp
    surface : Surface
    closing_tension : float
        [N]
    seating : Seating
    fingers : tuple of SettledFinger
        In the order of `FINGERS`.
    tiles : tuple of Tile
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
    nail_angles : ndarray, shape (4,)
        How far each finger's nail has turned; all the way where it does not hook [rad].
    nail_normals : ndarray, shape (4, 3)
        Out of the rock where each finger's nail hooks, in H; zero where none does.
    nail_rows : tuple of (ndarray, ndarray)
        H and h of `Fingernail.rows` of each nail that hooks, in the order of the tiles.
    stops : tuple of (int, int, ndarray)
        Finger, joint and the torque on its stop, affine in tension, of joints at their limits.
    palm : Palm
    """

    hand: SpinyHand
    hold: Hold
    grasp: Grasp
    surface: Surface
    closing_tension: float
    seating: Seating
    fingers: tuple[SettledFinger, ...]
    tiles: tuple[Tile, ...]
    finger_of: Indices
    positions: Array
    axes: Array
    loads: Array
    nail_angles: Array
    nail_normals: Array
    nail_rows: tuple[tuple[Array, Array], ...]
    stops: tuple[tuple[int, int, Array], ...]
    palm: Palm

    @cached_property
    def touching(self) -> Array:
        """Which tiles have rock under them, bool of shape (n,)."""
        return np.array([tile.contact in ("face", "edge") for tile in self.tiles])

    @cached_property
    def lateral_shares(self) -> Array:
        """Share of its finger's lateral reaction that each tile carries, shape (n,)."""
        counts = np.bincount(self.finger_of, weights=self.touching, minlength=len(FINGERS))
        return np.where(self.touching, 1.0 / np.maximum(counts, 1.0)[self.finger_of], 0.0)

    @cached_property
    def nails(self) -> Array:
        """Which tiles are nails that hook, bool of shape (n,)."""
        return np.array([tile.contact == NAIL for tile in self.tiles])

    @cached_property
    def holding(self) -> Array:
        """Which tiles and nails are on rock that they hold, bool of shape (n,)."""
        return np.logical_or(self.touching, self.nails)

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


@dataclass(frozen=True)
class FingerFrame:
    """A finger's frame in H: the proximal joint, and unit vectors along and across the finger."""

    joint: Array
    along: Array
    across: Array


def _cut(frame: FingerFrame, hold: Hold, grasp: Grasp, hand_in_hold: Pose) -> Section | None:
    """Return the rock in the plane of a finger's frame, raw under one that clings."""
    cut = hold.raw_section if grasp.fingernail else hold.section
    rotation = hand_in_hold.rotation
    return cut(hand_in_hold.apply(frame.joint), rotation @ frame.along, rotation[:, 2])


class SpinyHand:
    """The hand's geometry and mechanics.

    Parameters
    ----------
    table : ParameterTable, optional
        The numbers; ``parameters/hand.toml`` by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        self.table = table = table or hand_table()
        self.finger = FingerModel.from_table(table)
        self.drive = TendonDrive.from_table(table)
        self.structure = Structure.from_table(table)
        self.nail = Fingernail.from_table(table)
        self.mass = table.scalar("hand", "mass")
        self.maximum_tension = table.positive("tendon", "maximum_tension")
        self.closing_tension = table.positive("tendon", "closing_tension")
        if self.closing_tension > self.maximum_tension:
            raise InvalidInputError(
                f"must be at most the tendon's {self.maximum_tension:g} N, "
                f"got {self.closing_tension:g}",
                field="tendon.closing_tension",
            )
        for name in ("holding_friction", "entry_friction"):
            mu = table.scalar("tendon", name)
            if not 0.0 <= mu < 1.0:
                raise InvalidInputError(f"must be in [0, 1), got {mu:g}", field=f"tendon.{name}")
        self.tendon_friction = table.scalar("tendon", "holding_friction")
        self.spine_travel = table.scalar("tile", "spine_travel")
        self.lateral_stiffness = table.positive("tile", "lateral_stiffness")
        self.bending_stiffness = table.positive("beam", "bending_stiffness")
        self.torsional_stiffness = table.positive("beam", "torsional_stiffness")
        self.seated_contact = table.scalar("finger", "seated_contact")
        self.inner_joint = np.array(table.vector("fingers", "inner_joint"))
        self.outer_axis = np.array(table.vector("fingers", "outer_axis"))
        self.outer_reach = table.scalar("fingers", "outer_reach")
        self.base_tile_reach = table.scalar("fingers", "base_tile_reach")
        self.base_tile_surface = table.scalar("fingers", "base_tile_surface")
        self.palm_tiles = np.array(
            [
                (x, y, 0.0)
                for x in table.vector("palm", "tile_x")
                for y in table.vector("palm", "tile_y")
            ]
        )
        self.palm_tile_size = np.array(table.vector("palm", "tile_size"))
        self.palm_length = table.positive("palm", "length")
        self.palm_friction = table.scalar("palm", "pulley_friction")
        self.palm_own_friction = table.scalar("palm", "own_pulley_friction")
        self.palm_spring = table.scalar("palm", "spring_stiffness")
        self.palm_contact = table.vector("palm", "contact_stiffness")
        self.palm_pressing = table.positive("palm", "pressing_limit")
        self.palm_pressing_stiffness = table.positive("palm", "pressing_stiffness")
        if len(self.palm_contact) != len(self.palm_tiles):
            raise InvalidInputError(
                f"one number for each of the {len(self.palm_tiles)} tiles",
                field="palm.contact_stiffness",
            )
        try:
            PalmTendon(
                self.palm_contact, self.palm_spring, self.palm_friction, self.palm_own_friction
            )
        except InvalidInputError as error:
            entry = str(error.field).replace("friction", "pulley_friction")
            raise InvalidInputError(error.message, field=f"palm.{entry}") from None

    def frames(self, outer_rotation: float) -> tuple[FingerFrame, ...]:
        """Return the four fingers' frames in H, in the order of `FINGERS`."""
        frames = []
        for name in FINGERS:
            side = 1.0 if name.endswith("left") else -1.0
            mirror = np.array([1.0, side, 1.0])
            if name.startswith("inner"):
                joint, along = self.inner_joint * mirror, np.array([1.0, 0.0, 0.0])
            else:
                along = np.array([math.cos(outer_rotation), side * math.sin(outer_rotation), 0.0])
                joint = self.outer_axis * mirror + self.outer_reach * along
            across = np.array([-along[1], along[0], 0.0])
            frames.append(FingerFrame(joint, along, across))
        return tuple(frames)

    def seat(self, hold: Hold, grasp: Grasp) -> Seating:
        """Seat the hand on a hold that was given no place; see `hand_models.seating`."""
        return seat(self, hold, grasp)

    def section(self, finger: str, hold: Hold, grasp: Grasp, hold_in_hand: Pose) -> Section | None:
        """Return the rock in a finger's plane, in its coordinates F; raw under one that clings."""
        frame = self.frames(grasp.outer_rotation)[FINGERS.index(finger)]
        return _cut(frame, hold, grasp, hold_in_hand.inverse())

    def settle(
        self,
        hold: Hold,
        surface: Surface,
        grasp: Grasp | None = None,
        hold_in_hand: Pose | None = None,
    ) -> SettledHand:
        """Close the hand on a hold.

        Parameters
        ----------
        hold : Hold
        surface : Surface
            What a tile holds on it.
        grasp : Grasp, optional
        hold_in_hand : Pose, optional
            The hold's frame in H; without it the hand is seated (see `seat`).

        Raises
        ------
        InvalidInputError
            If the rock stands deeper in the palm than the spines can retract, or in a finger
            wherever its joints turn.
        """
        grasp = grasp or Grasp()
        closing = self.closing_tension if grasp.closing_tension is None else grasp.closing_tension
        if closing > self.maximum_tension:
            raise InvalidInputError(
                f"must be at most the tendon's {self.maximum_tension:g} N, got {closing:g}",
                field="grasp.closing_tension",
            )
        seating = self.seat(hold, grasp) if hold_in_hand is None else Seating(hold_in_hand, "given")
        hand_in_hold = seating.pose.inverse()
        into_rock = hand_in_hold.rotation[:, 2]
        palm = self._settle_palm(hold, surface, grasp, hand_in_hold)

        frames = self.frames(grasp.outer_rotation)
        sections = [_cut(frame, hold, grasp, hand_in_hold) for frame in frames]
        closed = [
            self._close(name, section, surface, grasp, closing)
            for name, section in zip(FINGERS, sections, strict=True)
        ]
        nail_angles = np.full(len(FINGERS), self.nail.retraction)
        nail_normals = np.zeros((len(FINGERS), 3))
        nail_rows: list[tuple[Array, Array]] = []
        tiles: list[Tile] = []
        positions, axes, loads = [], [], []
        stops: list[tuple[int, int, Array]] = []
        up = np.array([0.0, 0.0, 1.0])
        for i, (name, frame, (finger, shears, normals, torques)) in enumerate(
            zip(FINGERS, frames, closed, strict=True)
        ):
            outer = name.startswith("outer")
            if outer:
                place = frame.joint + frame.along * (self.base_tile_reach - self.outer_reach)
                place = np.array([place[0], place[1], self.base_tile_surface])
                gap = hold.entry(hand_in_hold.apply(place), into_rock)
                engaged = abs(gap) <= self.spine_travel and not grasp.fingernail
                tiles.append(Tile(name, "base", "face" if engaged else "none"))
                positions.append((place + gap * up if engaged else place)[None])
                axes.append(np.stack([-frame.along, up, frame.across])[None])
                gain = self.finger.shear_gain
                shear = ((self.finger.base_engagement - gain) * closing, gain)
                loads.append(np.array([[shear if engaged else (0.0, 0.0), (0.0, 0.0)]]))
            u = finger.directions
            along = u[:, :1] * frame.along + u[:, 1:] * up
            into = -u[:, 1:] * frame.along + u[:, :1] * up
            across = np.broadcast_to(frame.across, along.shape)
            points = finger.points
            tiles.extend(
                Tile(name, phalanx, contact.kind)
                for phalanx, contact in zip(PHALANGES, finger.contacts, strict=True)
            )
            positions.append(frame.joint + points[:, :1] * frame.along + points[:, 1:] * up)
            axes.append(np.stack([-along, into, across], axis=1))
            loads.append(np.stack([shears, normals], axis=1))
            if grasp.fingernail:
                cling = self._cling(name, sections[i], finger, closing)
                angle = nail_angles[i] if cling is None else cling.hook.angle
                reach = self.nail.length if cling is None else cling.hook.distance
                w = math.cos(angle) * frame.along + math.sin(angle) * up
                v = -math.sin(angle) * frame.along + math.cos(angle) * up
                tiles.append(Tile(name, NAIL, "none" if cling is None else NAIL))
                positions.append((frame.joint + finger.pin[0] * frame.along + reach * w)[None])
                axes.append(np.stack([-w, v, frame.across])[None])
                force = (0.0, 0.0) if cling is None else cling.force
                loads.append(np.array([[(0.0, 0.0), force]]))
                if cling is not None:
                    nail_angles[i], (s, t) = angle, cling.hook.normal
                    nail_normals[i] = s * frame.along + t * up
                    nail_rows.append((cling.H, cling.h))
            if finger.bearing:
                stops.extend(
                    (i, j, torques[j] if contact.stop == "upper" else -torques[j])
                    for j, contact in enumerate(finger.contacts)
                    if contact.stop in ("upper", "lower")
                )
        return SettledHand(
            hand=self,
            hold=hold,
            grasp=grasp,
            surface=surface,
            closing_tension=closing,
            seating=seating,
            fingers=tuple(finger for finger, _, _, _ in closed),
            tiles=tuple(tiles),
            finger_of=np.array([FINGERS.index(tile.finger) for tile in tiles]),
            positions=np.concatenate(positions),
            axes=np.concatenate(axes),
            loads=np.concatenate(loads),
            nail_angles=nail_angles,
            nail_normals=nail_normals,
            nail_rows=tuple(nail_rows),
            stops=tuple(stops),
            palm=palm,
        )

    def _close(
        self,
        name: str,
        section: Section | None,
        surface: Surface,
        grasp: Grasp,
        closing_tension: float,
    ) -> ClosedFinger:
        if grasp.fingernail:
            closed = cling(self.finger, section)
            how = "straight, to cling with its nail"
        else:
            outer = name.startswith("outer")
            closed = close(self.finger, section, surface, closing_tension, outer)
            how = "even with its joints fully open"
        if closed is None:
            assert section is not None
            depth = 1e3 * intrusion(self.finger, section, straight=grasp.fingernail)
            raise InvalidInputError(
                f"the hold stands {depth:.1f} mm inside {name} {how}; "
                "move the hand away from the rock",
                field="hold",
            )
        return closed

    def _cling(
        self, name: str, section: Section | None, finger: SettledFinger, closing_tension: float
    ) -> Cling | None:
        if self.nail.stuck(section, finger.pin):
            raise InvalidInputError(
                f"the hold is in the way of the nail of {name}, straight ahead; "
                "move the hand away from the rock",
                field="hold",
            )
        return self.nail.cling(section, finger, closing_tension, name.startswith("outer"))

    def _settle_palm(self, hold: Hold, surface: Surface, grasp: Grasp, hand_in_hold: Pose) -> Palm:
        into_rock = hand_in_hold.rotation[:, 2]
        places = hand_in_hold.apply(self.palm_tiles)
        gaps = np.array([hold.entry(place, into_rock) for place in places])
        deepest = float(gaps.min())
        if deepest < -self.spine_travel:
            raise InvalidInputError(
                f"the hold stands {-1e3 * deepest:.1f} mm inside the palm; "
                f"at most {1e3 * self.spine_travel:g} mm (the spines' travel) is possible",
                field="hold",
            )
        engaged = tuple(int(i) for i in np.flatnonzero(gaps <= self.spine_travel))
        if not (grasp.palm and engaged):
            return Palm(gaps, engaged if grasp.palm else (), np.zeros(3), 0.0, 0.0)
        chosen = list(engaged)
        return Palm(
            gaps=gaps,
            engaged=engaged,
            centre=np.append(self.palm_tiles[chosen, :2].mean(axis=0), gaps[chosen].mean()),
            shear_limit=shear_capacity(
                tuple(self.palm_contact[i] for i in engaged),
                self.palm_spring,
                self.palm_friction,
                surface.shear_limit,
                self.palm_own_friction,
            ),
            pressing_limit=self.palm_pressing * len(engaged),
        )


@lru_cache(maxsize=32)
def spiny_hand(table: ParameterTable | None = None) -> SpinyHand:
    """Return the SpinyHand of a table, built once; of the bundled one by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.
    """
    return SpinyHand(table)
