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
from functools import cache, cached_property
from typing import Final

import numpy as np
from scipy.optimize import brentq

from hand_models.errors import InvalidInputError
from hand_models.finger import PHALANGES, Contact, FingerModel, SettledFinger
from hand_models.frames import Array, Indices, Pose
from hand_models.holds import Hold, Plane
from hand_models.palm import shear_capacity
from hand_models.parameters import ParameterTable, hand_table
from hand_models.spines import Surface

__all__ = ["FINGERS", "Grasp", "Palm", "Seating", "SettledHand", "SpinyHand", "Tile", "spiny_hand"]

FINGERS: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Order of every list of four tensions; left is +y of H."""

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
    """

    outer_rotation: float = 0.0
    closing_tension: float | None = None
    palm: bool = True
    lateral: bool = True

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
class Seating:
    """Where a hold is in the hand.

    Attributes
    ----------
    pose : Pose
        The hold's frame in H.
    rule : {'given', 'pinch', 'palm_on_rock', 'palm_on_rock_centred', 'flat'}
        How it was found.
    """

    pose: Pose
    rule: str


@dataclass(frozen=True)
class Tile:
    """One finger tile's place among the hand's rows and columns.

    Attributes
    ----------
    finger : str
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``.
    contact : {'face', 'edge', 'none'}
        What of it touches the rock.
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
        The 14 finger tiles, finger by finger, from the base outward.
    finger_of : ndarray of int, shape (14,)
        Index of each tile's finger.
    positions : ndarray, shape (14, 3)
        Of each tile's contact in H [m].
    axes : ndarray, shape (14, 3, 3)
        Rows: the unit force on the rock of shear, of normal and of lateral load, in H.
    loads : ndarray, shape (14, 2, 2)
        Shear and normal load, each at zero tension [N] and per newton of tension.
    stops : tuple of (int, int, ndarray)
        Finger, joint and torque, affine in tension, of joints held by their upper stops.
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
    stops: tuple[tuple[int, int, Array], ...]
    palm: Palm

    @cached_property
    def touching(self) -> Array:
        """Which tiles have rock under them, bool of shape (14,)."""
        return np.array([tile.contact != "none" for tile in self.tiles])

    @cached_property
    def lateral_shares(self) -> Array:
        """Share of its finger's lateral reaction that each tile carries, shape (14,)."""
        counts = np.bincount(self.finger_of, weights=self.touching, minlength=len(FINGERS))
        return np.where(self.touching, 1.0 / np.maximum(counts, 1.0)[self.finger_of], 0.0)

    def tile_loads(self, tensions: Array, laterals: Array | None = None) -> Array:
        """Return shear, normal and lateral load of each finger tile.

        Parameters
        ----------
        tensions : ndarray, shape (4,)
            Of the tendons [N].
        laterals : ndarray, shape (4,), optional
            Lateral reaction of each finger on the rock [N].

        Returns
        -------
        ndarray, shape (14, 3)
            [N]; c_sys + f c_act of Eq. 14.
        """
        f = np.asarray(tensions, dtype=float)[self.finger_of]
        y = np.zeros(len(FINGERS)) if laterals is None else np.asarray(laterals, dtype=float)
        planar = self.loads[..., 0] + self.loads[..., 1] * f[:, None]
        return np.column_stack([planar, self.lateral_shares * y[self.finger_of]])


@dataclass(frozen=True)
class _Frame:
    """A finger's frame in H: the proximal joint, and unit vectors along and across the finger."""

    joint: Array
    along: Array
    across: Array


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
        self.mass = table.scalar("hand", "mass")
        self.maximum_tension = table.scalar("tendon", "maximum_tension")
        self.closing_tension = table.scalar("tendon", "closing_tension")
        self.spine_travel = table.scalar("tile", "spine_travel")
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
        self.palm_length = table.scalar("palm", "length")
        self.palm_friction = table.scalar("palm", "pulley_friction")
        self.palm_spring = table.scalar("palm", "spring_stiffness")
        self.palm_contact = table.vector("palm", "contact_stiffness")
        self.palm_pressing = table.scalar("palm", "pressing_limit")
        if len(self.palm_contact) != len(self.palm_tiles):
            raise InvalidInputError(
                f"one number for each of the {len(self.palm_tiles)} tiles",
                field="palm.contact_stiffness",
            )

    def frames(self, outer_rotation: float) -> tuple[_Frame, ...]:
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
            frames.append(_Frame(joint, along, across))
        return tuple(frames)

    def seat(self, hold: Hold, grasp: Grasp) -> Seating:
        """Seat the hand on a hold that was given no place (axes parallel to H's).

        The proximal tiles of the inner fingers touch at ``seated_contact`` from their joints. In a
        pinch the crest lies midway between the opposed bases and the palm stands off as follows;
        otherwise the palm rests on the rock and the crest's place along x follows. Where that
        cannot be had, the palm rests on the rock with the crest under its centre. On a plane the
        finger tiles lie flat, and the palm stands off by their height, within the spines' travel.
        """
        x, y, z = (float(v) for v in self.inner_joint)
        if isinstance(hold, Plane):
            height = self.finger.tile_height
            return Seating(Pose(np.array([0.0, 0.0, z + height]), np.eye(3)), "flat")
        centred = Seating(Pose.identity(), "palm_on_rock_centred")
        opposed = float(self.outer_axis[0]) - self.outer_reach
        crest = 0.5 * (x + opposed) if grasp.pinch else None
        circle = hold.crest_circle(y)
        place = (
            self._seat_smooth(hold, crest) if circle is None else self._seat_round(*circle, crest)
        )
        if place is None:
            return centred
        pose = Pose(np.array([place[0], 0.0, place[1]]), np.eye(3))
        if grasp.pinch:
            seating, possible = Seating(pose, "pinch"), place[1] >= 0.0
        else:
            seating = Seating(pose, "palm_on_rock")
            possible = abs(place[0]) <= 0.5 * self.palm_length
        return seating if possible and self._seated(hold, grasp, seating) else centred

    def _seat_round(
        self, depth: float, radius: float, crest: float | None
    ) -> tuple[float, float] | None:
        """Return (x, z) of a round hold's crest, whose x may be given and whose z is else zero."""
        x, _, z = (float(v) for v in self.inner_joint)
        reach = (radius + self.finger.tile_height) ** 2 + self.seated_contact**2
        if crest is not None:
            rise = reach - (x - crest) ** 2
            return None if rise <= 0.0 else (crest, z + math.sqrt(rise) - depth)
        run = reach - (depth - z) ** 2
        return None if run <= 0.0 else (x - math.sqrt(run), 0.0)

    def _seat_smooth(self, hold: Hold, crest: float | None) -> tuple[float, float] | None:
        """Do the same for a smooth hold that is not round, over the proximal phalanx's angle."""
        x, y, z = (float(v) for v in self.inner_joint)

        def place(angle: float) -> tuple[float, float] | None:
            point = hold.tangent_point(y, angle)
            if point is None:
                return None
            tile = Contact(angle, (x, z), self.seated_contact, "face").point(
                self.finger.tile_height
            )
            return tile[0] - point[0], tile[1] - point[1]

        def miss(angle: float) -> float:
            there = place(angle)
            assert there is not None
            return there[0] - crest if crest is not None else there[1]

        if place(0.0) is None:
            return None
        angles = np.linspace(0.0, self.finger.joint_upper[0], 64)
        misses = np.array([miss(float(angle)) for angle in angles])
        turns = np.flatnonzero(np.sign(misses[:-1]) * np.sign(misses[1:]) <= 0.0)
        if not len(turns):
            return None
        first = int(turns[0])
        root = brentq(miss, float(angles[first]), float(angles[first + 1]), xtol=1e-13)
        return place(float(root))

    def _seated(self, hold: Hold, grasp: Grasp, seating: Seating) -> bool:
        """Whether the inner fingers' proximal tiles do touch where seating meant them to."""
        frame = self.frames(grasp.outer_rotation)[FINGERS.index("inner_left")]
        finger = self._settle_finger(frame, hold, seating.pose.inverse())
        contact = finger.contacts[0]
        return contact.kind == "face" and abs(contact.along - self.seated_contact) < 1e-6

    def _settle_finger(self, frame: _Frame, hold: Hold, hand_in_hold: Pose) -> SettledFinger:
        rotation = hand_in_hold.rotation
        section = hold.section(
            hand_in_hold.apply(frame.joint), rotation @ frame.along, rotation[:, 2]
        )
        return self.finger.settle(section, (0.0, 0.0))

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
            If the rock stands deeper in the palm than the spines can retract.
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
        closed = [
            _close(
                self._settle_finger(frame, hold, hand_in_hold), closing, name.startswith("outer")
            )
            for name, frame in zip(FINGERS, frames, strict=True)
        ]
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
                engaged = abs(gap) <= self.spine_travel
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
            if any(finger.touching):
                stops.extend(
                    (i, j, torques[j]) for j in range(len(PHALANGES)) if not finger.touching[j]
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
            stops=tuple(stops),
            palm=palm,
        )

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
            ),
            pressing_limit=self.palm_pressing * len(engaged),
        )


def _close(
    finger: SettledFinger, closing_tension: float, outer: bool
) -> tuple[SettledFinger, Array, Array, Array]:
    """Return a finger with its shears, normals and stop torques, affine in tension.

    If no tension keeps its tiles dragged forward and its joints' stops pushing, the finger cannot
    stay where it closed: it is released, and carries nothing.
    """
    shears = finger.shears(closing_tension, base_tile=outer)
    normals = finger.normals(shears, base_tile=outer)
    torques = finger.stop_torques(shears, normals, base_tile=outer)
    least, most = 0.0, math.inf
    for constant, slope in np.vstack([shears, torques]):
        if slope > 0.0:
            least = max(least, -constant / slope)
        elif slope < 0.0:
            most = min(most, -constant / slope)
        elif constant < 0.0:
            most = -math.inf
    if any(finger.touching) and least > most:
        return _close(finger.released(), closing_tension, outer)
    return finger, shears, normals, torques


@cache
def spiny_hand() -> SpinyHand:
    """Return the SpinyHand of the bundled parameter file."""
    return SpinyHand()
