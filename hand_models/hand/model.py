"""Hand model: four fingers and a palm in the hand frame H.

H has its origin at the centre of the palm's tile grid, on the tiles' surface: x along the two inner
fingers, z out of the palm into the rock, y = z × x. The two outer fingers turn on their bases by
``outer_rotation``, outward through ±y: 0 makes all four parallel, π opposes them (a pinch).

A *base tile* is on the rotating base of each outer finger, under the same tendon. It cannot turn
toward the rock, so like a palm tile it engages where rock is within its spines' travel; then the
tendon drags it like the other tiles, and it carries shear and its share of the lateral reaction,
but no normal load (``assumed``).
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from hand_models.base import BoundedStore, InvalidInputError, Pose
from hand_models.finger import FingerModel, Fingernail, SequentialClosure
from hand_models.hand.finger_frames import OUTER_FINGERS, FingerFrame, FrameStack
from hand_models.hand.grasp import Grasp
from hand_models.hand.names import FINGERS
from hand_models.hand.structure import Structure
from hand_models.parameters import ParameterTable, hand_table
from hand_models.rock import Hold
from hand_models.sections import Section
from hand_models.tendon import TendonDrive, check_palm, shear_capacity

__all__ = ["HandModel"]


class HandModel:
    """Geometry, mechanics and limits of a hand, independent of any hold.

    Attributes are the numbers of the table, most with the names of their entries, in SI units;
    ``finger``, ``drive``, ``structure`` and ``nail`` hold those of one finger. Models of equal
    parameter tables are equal and have the same hash.

    Parameters
    ----------
    table : ParameterTable, optional
        The hand's numbers; ``parameters/hand.toml`` by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        self.table = table = table or hand_table()
        self._hash = hash(table)
        self._frames: BoundedStore[tuple[float, ...], FrameStack] = BoundedStore(
            "frames of fingers",
            most=64,  # choices of outer rotations
        )
        self.finger = FingerModel.from_table(table)
        self.drive = TendonDrive.from_table(table)
        self.structure = Structure.from_table(table)
        self.nail = Fingernail.from_table(table)
        self.sequential_closure = SequentialClosure(self.finger)
        self.depths = [self.finger.depths(base_tile).tolist() for base_tile in (False, True)]
        # a tile on a finger's base only shifts the others on a tendon that rubs
        self.rubbing = [name.startswith("outer") and self.finger.friction > 0.0 for name in FINGERS]
        # the diagonal of M (Eq. 8) of each finger, whose first tile an outer one's base has
        self.losses = np.array([self.finger.losses(name.startswith("outer")) for name in FINGERS])
        self.mass = table.scalar("hand", "mass")
        self.maximum_tension = table.positive("tendon", "maximum_tension")
        self.closing_tension = table.positive("tendon", "closing_tension")
        if self.closing_tension > self.maximum_tension:
            raise InvalidInputError(
                f"must be at most tendon.maximum_tension, {self.maximum_tension:g} N, got "
                f"{self.closing_tension:g} N; lower it, or raise maximum_tension",
                field="tendon.closing_tension",
            )
        for name in ("holding_friction", "entry_friction"):
            mu = table.scalar("tendon", name)
            if not 0.0 <= mu < 1.0:
                raise InvalidInputError(f"must be in [0, 1), got {mu:g}", field=f"tendon.{name}")
        self.tendon_friction = table.scalar("tendon", "holding_friction")
        self.spine_travel = table.scalar("tile", "spine_travel")
        self.engagement_exponent = table.positive("tile", "engagement_exponent")
        self.least_share = self.finger.least_share
        self.rock_stiffness_ratio = table.positive("tile", "rock_stiffness_ratio")
        self.largest_tile_stretch = table.positive("tile", "largest_tile_stretch")
        self.lateral_stiffness = table.positive("tile", "lateral_stiffness")
        self.bending_stiffness = table.positive("beam", "bending_stiffness")
        self.torsional_stiffness = table.positive("beam", "torsional_stiffness")
        self.seated_contact = table.scalar("finger", "seated_contact")
        self.back_off = table.scalar("seat", "back_off")
        self.seat_turn = table.scalar("seat", "turn")
        self.seat_tilt = table.scalar("seat", "tilt")
        self.seat_scatter = (
            table.scalar("seat", "scatter_position"),
            table.scalar("seat", "scatter_angle"),
        )
        self.contact_scatter = (
            table.scalar("seat", "contact_position"),
            table.scalar("seat", "contact_angle"),
        )
        self.inner_joint = np.array(table.vector("fingers", "inner_joint"))
        self.inner_place = x, _, _ = table.vector("fingers", "inner_joint")
        self.outer_axis = np.array(table.vector("fingers", "outer_axis"))
        self.outer_reach = table.scalar("fingers", "outer_reach")
        self.pinch_crest = 0.5 * (x + self.outer_axis.item(0) - self.outer_reach)
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
                f"one number for each of the {len(self.palm_tiles)} tiles is needed, "
                f"got {len(self.palm_contact)}",
                field="palm.contact_stiffness",
            )
        try:
            check_palm(
                self.palm_contact, self.palm_spring, self.palm_friction, self.palm_own_friction
            )
        except InvalidInputError as error:
            entry = str(error.field).replace("friction", "pulley_friction")
            raise InvalidInputError(error.message, field=f"palm.{entry}") from None

    def __reduce__(self) -> tuple[Any, ...]:
        # hashes of words differ from process to process
        return type(self), (self.table,)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        """Return True if both are the same hand: of equal numbers."""
        return self is other or (isinstance(other, HandModel) and self.table == other.table)

    def frames(self, outer_rotation: float) -> tuple[FingerFrame, ...]:
        """Return the frames of the four fingers in the hand frame H, in the order of `FINGERS`.

        ``outer_rotation``: rotation of the outer fingers, from 0 to π [rad].
        """
        return self.frame_stack((outer_rotation,)).hands[0]

    def frame_stack(self, outer_rotations: tuple[float, ...]) -> FrameStack:
        """Return the finger frames of n hands, whose outer fingers have n rotations [rad].

        ``outer_rotations``: from 0 to π each. The last 64 results are kept in an LRU cache.
        """
        return self._frames.get(outer_rotations, partial(self._frame_stack, outer_rotations))

    def _frame_stack(self, outer_rotations: tuple[float, ...]) -> FrameStack:
        outer = np.array([[name.startswith("outer")] for name in FINGERS])
        side = np.array([[1.0 if name.endswith("left") else -1.0] for name in FINGERS])
        mirror = np.insert(np.ones((len(FINGERS), 2)), [1], side, axis=1)
        turned = np.array([(math.cos(angle), math.sin(angle), 0.0) for angle in outer_rotations])
        alongs = np.where(outer, turned[:, None] * mirror, (1.0, 0.0, 0.0))
        joints = np.where(
            outer, self.outer_axis * mirror + self.outer_reach * alongs, self.inner_joint * mirror
        )
        bases = (joints + alongs * (self.base_tile_reach - self.outer_reach))[:, OUTER_FINGERS]
        bases[..., 2] = self.base_tile_surface
        return FrameStack.of(joints, alongs, bases, self.palm_tiles, self.finger.size)

    def palm_share(self, engaged: tuple[int, ...], tile_limit: float) -> float:
        """Return the shear of a palm when the first of its engaged tiles reaches its limit [N].

        Parameters
        ----------
        engaged : tuple of int
            Indices of the engaged palm tiles, which share the load on one tendon.
        tile_limit : float
            Shear strength of one tile [N].
        """
        stiffness = tuple([self.palm_contact[i] for i in engaged])
        friction = self.palm_friction, tile_limit, self.palm_own_friction
        return shear_capacity(stiffness, self.palm_spring, *friction)

    def section(self, finger: str, hold: Hold, grasp: Grasp, hold_in_hand: Pose) -> Section | None:
        """Return the rock in a finger's plane, in its coordinates F; None if there is none.

        Parameters
        ----------
        finger : str
            One of `FINGERS`.
        hold : Hold
        grasp : Grasp
            In a fingernail grasp the section is `Hold.raw_section`.
        hold_in_hand : Pose
            The hold's frame in the hand frame H.
        """
        frame = self.frames(grasp.outer_rotation)[FINGERS.index(finger)]
        return frame.cut(hold, hold_in_hand.inverse(), raw=grasp.fingernail)
