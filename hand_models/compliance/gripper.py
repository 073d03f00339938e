"""The paper's test gripper: two of the hand's fingers, opposed, on a frame in a plane (Sec. 6.2).

Its frame G has z into the rock and x along one finger; the proximal joints are at ±b. Tensions are
kept by springs at the tendons' ends (the scheme ``tension``). Its wrist pose is (x, z, ω_y): ω_y is
about y = z × x, as in the contract, whose M_y is minus the paper's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices, InvalidInputError
from hand_models.compliance.compliant_finger import STEP, CompliantFinger, FingerLoads
from hand_models.compliance.grasp import Evaluation, Verdict, range_rows
from hand_models.compliance.rolling import Numbers
from hand_models.finger import PHALANGES, FingerModel, settle_finger
from hand_models.fixed_wrist import named_row
from hand_models.parameters import ParameterTable, Quantity, experiment_table, hand_table
from hand_models.sections import Disc
from hand_models.tendon import FingerTendon, MotorScheme
from hand_models.tile import Surface, inner_half_planes
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = ["PLANE", "SIDES", "Gripper", "gripper_table"]

SIDES: Final = ("right", "left")
"""Fingers: the one along +x of G, and the one along −x."""

PLANE: Final = ("wrist/vx", "wrist/vz", "wrist/wy")
"""Columns of its wrench space [m, rad]."""

OWN: Final = {
    "tile_height": "finger",
    "pulley_radii": "finger",
    "seated_contact": "finger",
    "engagement": "tile",
}
"""Entries of ``[gripper]`` that stand for the hand's own, and their section there."""


def gripper_table(hand: ParameterTable | None = None) -> ParameterTable:
    """Return the gripper's numbers: the hand's, the experiment's in their place, a caller's on top.

    Parameters
    ----------
    hand : ParameterTable, optional
        A hand's table. Its entries that differ from the bundled ones count as the caller's.
    """
    bundled, gripper = hand_table(), experiment_table().sections["gripper"]
    table = ParameterTable({**bundled.sections, "gripper": gripper})
    own: dict[str, dict[str, Quantity]] = {}
    for name, section in OWN.items():
        own.setdefault(section, {})[name] = gripper[name]
    table = table.replaced(ParameterTable(own))
    if hand is None:
        return table
    changed = hand.difference(bundled)
    stiffness = changed.sections.get("tile", {}).get("contact_stiffness")
    if stiffness is not None:
        spread = [changed.scalar("tile", "contact_stiffness")] * len(PHALANGES)
        each = Quantity(spread, stiffness.unit, stiffness.source, stiffness.note)
        table = table.replaced(ParameterTable({"gripper": {"contact_stiffness": each}}))
    return table.replaced(changed)


@dataclass(frozen=True)
class _Numbers:
    """What of the table the gripper reads itself."""

    half_spacing: float
    added_radius: float
    origin_height: float
    contact_stiffness: tuple[float, ...]
    entry_friction: float
    seated_contact: float


class Gripper:
    """Two opposed fingers on a round surface, their wrist free to move in the plane.

    Parameters
    ----------
    diameter : float
        Of the round surface, without what is mounted on it [m].
    tension : float
        Of both tendons, at which they closed [N].
    surface : Surface, optional
        What a tile holds; the experiment's sandpaper by default.
    table : ParameterTable, optional
        From `gripper_table`.
    scheme : {'tension', 'held'}
        Whether springs keep the tension, as in the experiments, or motors stand still.

    Raises
    ------
    InvalidInputError
        If a number is out of range, or the fingers do not all lie on the surface.
    """

    def __init__(
        self,
        diameter: float,
        tension: float,
        surface: Surface | None = None,
        table: ParameterTable | None = None,
        scheme: MotorScheme = "tension",
    ) -> None:
        if not (math.isfinite(diameter) and diameter > 0.0):
            raise InvalidInputError(f"must be above 0 m, got {diameter:g}", field="diameter")
        if not (math.isfinite(tension) and tension > 0.0):
            raise InvalidInputError(f"must be above 0 N, got {tension:g}", field="tension")
        self.table = table = table or gripper_table()
        self.surface = surface or sandpaper(table)
        self.tension = tension
        self.numbers = _Numbers(
            half_spacing=table.scalar("gripper", "base_half_spacing"),
            added_radius=table.scalar("gripper", "added_radius"),
            origin_height=table.scalar("gripper", "origin_height"),
            contact_stiffness=table.vector("gripper", "contact_stiffness"),
            entry_friction=table.scalar("gripper", "entry_friction"),
            seated_contact=table.scalar("finger", "seated_contact"),
        )
        model = FingerModel.from_table(table)
        radius = 0.5 * diameter + self.numbers.added_radius
        away, spread = radius + model.tile_height, self.numbers.half_spacing
        square = self.numbers.seated_contact**2 + away**2 - spread**2
        if square <= 0.0:
            raise InvalidInputError(
                f"the bases are {2e3 * spread:g} mm apart, too far for this surface",
                field="gripper.base_half_spacing",
            )
        self.section = Disc(complex(-spread, math.sqrt(square)), radius)
        finger = settle_finger(model, self.section, (0.0, 0.0))
        if len(finger.bearing) != len(PHALANGES) or not all(finger.touching):
            raise InvalidInputError(
                f"the fingers do not lie on a surface of {1e3 * diameter:g} mm", field="diameter"
            )
        shears = finger.shears(tension) @ np.array([1.0, tension])
        tendon = FingerTendon.from_table(table)
        self.finger = CompliantFinger(
            finger,
            self.section,
            replace(
                tendon,
                contact_stiffness=self.numbers.contact_stiffness,
                friction=max(table.scalar("tendon", "holding_friction"), tendon.friction),
                entry_friction=self.numbers.entry_friction,
            ),
            tendon.closed(tension, shears),
            scheme,
        )
        self._pieces = inner_half_planes(self.surface)

    @property
    def limits(self) -> tuple[Row, ...]:
        """Limit rows: each side's tiles, proximal first, and their half-planes."""
        return tuple(
            named_row(side, phalanx, piece.limit, "limit")
            for side in SIDES
            for phalanx in PHALANGES
            for piece in self._pieces
        )

    def finger_loads(self, twists: Numbers) -> tuple[FingerLoads, FingerLoads]:
        """Return the loads of both fingers, right first, at wrist poses of shape (m, 3)."""
        return self._finger_loads(0, twists), self._finger_loads(1, twists)

    def _finger_loads(self, side: int, twists: Numbers) -> FingerLoads:
        x, z, turn = np.moveaxis(np.asarray(twists), -1, 0)
        spread, deep = self.numbers.half_spacing, self.numbers.origin_height
        # the joints are at (±b, −origin_height) of the origin; ω_y turns z toward x
        cosine, sine = np.cos(turn) - 1.0, np.sin(turn)
        if side == 0:
            moved = (x + spread * cosine - deep * sine, z - deep * cosine - spread * sine, -turn)
        else:
            moved = (-x + spread * cosine + deep * sine, z - deep * cosine + spread * sine, turn)
        return self.finger.loads(*moved)

    def wrenches(self, loads: tuple[FingerLoads, FingerLoads]) -> Numbers:
        """Return the wrenches on the rock about G's origin, in the contract's signs, (m, 6)."""
        spread, deep = self.numbers.half_spacing, self.numbers.origin_height
        right, left = (side.planar_wrench for side in loads)
        wrenches = np.zeros((len(right), 6), dtype=right.dtype)
        wrenches[:, 0] = right[:, 0] - left[:, 0]
        wrenches[:, 2] = right[:, 1] + left[:, 1]
        # M_y = z F_x − x F_z; a finger's own M is from x toward z
        own = -right[:, 2] + left[:, 2] - deep * wrenches[:, 0]
        wrenches[:, 4] = own - spread * (right[:, 1] - left[:, 1])
        return wrenches

    def _used(self, loads: Sequence[FingerLoads]) -> Numbers:
        """Return loads over capacities of the limit rows, shape (m, rows)."""
        used = [
            (piece.a_shear * side.shears[:, i] + piece.a_normal * side.normals[:, i])
            / piece.capacity
            for side in loads
            for i in range(len(PHALANGES))
            for piece in self._pieces
        ]
        return np.stack(used, axis=-1)

    def sieve(self, twists: Array) -> Indices:
        """Return which wrist poses pass the limits of the right finger, then of the left one."""
        left = np.arange(len(twists))
        for side in range(len(SIDES)):
            loads = self._finger_loads(side, twists[left])
            with np.errstate(invalid="ignore"):
                used = self._used((loads,)).max(axis=1)
                holds = loads.reached & (used <= 1.0) & (loads.shears >= 0.0).all(axis=1)
            left = left[holds]
        return left

    def evaluate(self, twists: Array) -> Evaluation:
        """Return wrenches and limits at wrist poses of shape (m, 3)."""
        loads = self.finger_loads(twists)
        reached = loads[0].reached & loads[1].reached
        with np.errstate(invalid="ignore"):
            used = np.where(reached[:, None], self._used(loads), np.inf)
            backwards = -np.concatenate([side.shears for side in loads], axis=1)
            broken = np.where(reached, backwards.max(axis=1), np.inf)
        return Evaluation(
            self.wrenches(loads), Verdict(used.max(axis=1), used.argmax(axis=1), broken)
        )

    def linearised(
        self, twist: ArrayLike | None = None, within: ArrayLike | None = None
    ) -> WrenchSpace:
        """Return the set linearised at a wrist pose, with columns `PLANE`.

        Parameters
        ----------
        twist : array_like, shape (3,), optional
            At rest by default.
        within : array_like, shape (3,), optional
            How far from it the pose may go.
        """
        at = np.zeros(3) if twist is None else np.asarray(twist, dtype=float)
        loads = self.finger_loads(at + 1j * STEP * np.eye(3))

        def affine(values: NDArray[Any]) -> tuple[Array, Array]:
            slope = np.asarray(values.imag.T / STEP)
            return values[0].real - slope @ at, slope

        origin, generators = affine(self.wrenches(loads))
        l0, L = affine(self._used(loads))
        h, H = affine(np.concatenate([side.shears for side in loads], axis=1))
        rows = self.limits + tuple(
            named_row(side, phalanx, "dragged_backwards", "hard")
            for side in SIDES
            for phalanx in PHALANGES
        )
        H = -H
        if within is not None:
            sides, most, names = range_rows(PLANE, at, within)
            H, h, rows = np.vstack([H, sides]), np.concatenate([h, most]), rows + names
        s = np.array([piece.capacity for piece in self._pieces] * (2 * len(PHALANGES)))
        return WrenchSpace(
            origin=origin,
            generators=generators,
            columns=PLANE,
            rows=rows,
            L=L * s[:, None],
            l0=l0 * s,
            s=s,
            H=H,
            h=h,
        )

    def stiffness(self) -> Array:
        """Return K_g in the plane (F_x, F_z, M_y over x, z, ω_y) at rest, shape (3, 3)."""
        return self.linearised().generators[[0, 2, 4]]


def sandpaper(table: ParameterTable) -> Surface:
    """Return what a tile holds on the experiment's sandpaper: T + k P = T_max under pull-off."""
    limit = table.scalar("gripper", "shear_limit")
    return pulled_off(Surface.from_values({"shear_limit": limit}), table)


def pulled_off(surface: Surface, table: ParameterTable) -> Surface:
    """Return a surface with the pull-off slope that the gripper's experiments ask for."""
    slope = table.scalar("gripper", "pull_off_slope")
    angle = surface.pull_off_angle
    values = {
        "shear_limit": surface.shear_limit,
        "pull_off_limit": surface.shear_limit / (math.cos(angle) + slope * math.sin(angle)),
        "lateral_limit": surface.lateral_limit,
    }
    return Surface.from_values(values)
