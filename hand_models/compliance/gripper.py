"""The paper's test gripper: two of the hand's fingers, opposed, on a frame in a plane (Sec. 6.2).

Its frame G has z into the rock and x along the right finger; the proximal joints are at x = ±b.
Springs at the tendons' ends keep the tensions (the scheme ``tension``). A pose of its wrist is
(x, z, ω_y): ω_y is a rotation about y = z × x, as everywhere in `crux`, where M_y is minus the
paper's.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from hand_models.base import InvalidInputError, check_positive
from hand_models.compliance.compliant_finger import CompliantFingers, FingerAtRest, FingerLoads
from hand_models.compliance.grasp import CompliantGrasp, GraspLoads, LoadRows, rows_of_range
from hand_models.compliance.link import Numbers
from hand_models.finger import PHALANGES, FingerModel, settle_finger
from hand_models.fixed_wrist import named_row
from hand_models.parameters import ParameterTable, Quantity, experiment_table, hand_table
from hand_models.sections import Disc
from hand_models.tendon import FingerTendon
from hand_models.tile import Surface, inner_half_planes

__all__ = ["GRIPPER_SIDES", "Gripper", "gripper_table"]

GRIPPER_SIDES: Final = ("right", "left")
"""Names of the fingers: the one along +x of G, and the one along −x."""


def gripper_table(hand: ParameterTable | None = None) -> ParameterTable:
    """Return the parameters of the gripper: the hand's, with those of the experiments put in.

    Parameters
    ----------
    hand : ParameterTable, optional
        A caller's hand table. Its entries that differ from the bundled ones take precedence.
    """
    bundled, gripper = hand_table(), experiment_table().sections["gripper"]
    table = ParameterTable({**bundled.sections, "gripper": gripper})
    own: dict[str, dict[str, Quantity]] = {}
    # entries of ``[gripper]`` that stand for the hand's own, and their section there
    sections = {
        "tile_height": "finger",
        "pulley_radii": "finger",
        "seated_contact": "finger",
        "engagement": "tile",
        "contact_stiffness": "tile",
    }
    for name, section in sections.items():
        own.setdefault(section, {})[name] = gripper[name]
    table = table.replaced(ParameterTable(own))
    if hand is None:
        return table
    changed = hand.difference(bundled)
    return table.replaced(changed)


class Gripper(CompliantGrasp):
    """Gripper of two opposed fingers on a round surface, its wrist free to move in the plane.

    A pose is (x, z, ω_y) [m, m, rad]. The loads e are the shears of the tiles, then their normal
    loads, those of the right finger first [N].

    Parameters
    ----------
    diameter : float
        Diameter of the round surface, without what is mounted on it [m].
    tension : float
        Tension at which both tendons closed [N].
    surface : Surface, optional
        Strength of a tile; the experiment's sandpaper by default.
    table : ParameterTable, optional
        Parameters from `gripper_table`; the bundled ones by default.
    most_pressing : float, optional
        Largest pressing force F_z that counts as within the limits [N]; any by default.

    Raises
    ------
    InvalidInputError
        If a number is out of range, or a phalanx of a finger does not touch the surface.
    """

    columns = ("wrist/vx", "wrist/vz", "wrist/wy")
    range_rows = rows_of_range(columns)

    def __init__(
        self,
        diameter: float,
        tension: float,
        surface: Surface | None = None,
        table: ParameterTable | None = None,
        most_pressing: float = math.inf,
    ) -> None:
        check_positive(diameter, "m", "diameter")
        check_positive(tension, "N", "tension")
        check_positive(most_pressing, "N", "most_pressing", most=math.inf)
        self.most_pressing = most_pressing
        self.table = table = table or gripper_table()
        self.surface = surface or sandpaper(table)
        self.half_spacing = spread = table.scalar("gripper", "base_half_spacing")
        self.origin_height = table.scalar("gripper", "origin_height")
        model = FingerModel.from_table(table)
        radius = 0.5 * diameter + table.scalar("gripper", "added_radius")
        away, seated = radius + model.tile_height, table.scalar("finger", "seated_contact")
        square = seated**2 + away**2 - spread**2
        if square <= 0.0:
            raise InvalidInputError(
                f"must be below {math.hypot(seated, away):.4g} m for fingers to reach a surface "
                f"{diameter:g} m in diameter, got {spread:g} m",
                field="gripper.base_half_spacing",
            )
        self.section = Disc(complex(-spread, math.sqrt(square)), radius)
        finger = settle_finger(model, self.section, (0.0, 0.0))
        if len(finger.bearing) != len(PHALANGES) or not all(finger.touching):
            raise InvalidInputError(
                f"a phalanx of each finger does not touch a surface with a diameter of "
                f"{1e3 * diameter:g} mm; give a larger one",
                field="diameter",
            )
        tendon = FingerTendon.from_table(table)
        own = FingerAtRest(
            finger,
            self.section,
            replace(
                tendon,
                friction=max(table.scalar("tendon", "holding_friction"), tendon.friction),
                entry_friction=table.scalar("gripper", "entry_friction"),
            ),
            tendon.friction,
            finger.shears(tension),
        )
        self.finger, self.tension = finger, tension
        self._fingers = CompliantFingers([own] * len(GRIPPER_SIDES), "tension")
        self.load_rows = self._load_rows()

    def _load_rows(self) -> LoadRows:
        """Return the rows of each side's tiles, proximal first, and their half-planes."""
        tiles = [(side, phalanx) for side in GRIPPER_SIDES for phalanx in PHALANGES]
        each, pieces = np.eye(len(tiles)), inner_half_planes(self.surface)
        limits = [named_row(*tile, piece.limit, "limit") for tile in tiles for piece in pieces]
        capped = math.isfinite(self.most_pressing)
        cap = [named_row(None, None, "most_pressing", "limit")] if capped else []
        slopes = np.array([(piece.a_shear, piece.a_normal) for piece in pieces])
        hard = [named_row(*tile, "dragged_backwards", "hard") for tile in tiles]
        return LoadRows(
            names=(*limits, *cap, *hard),
            P=np.hstack([np.kron(each, slopes[:, :1]), np.kron(each, slopes[:, 1:])]),
            p=np.zeros(len(limits)),
            D=np.eye(6)[[2] * len(cap)],
            s=np.array(
                [piece.capacity for piece in pieces] * len(tiles) + [self.most_pressing] * len(cap)
            ),
            Q=np.hstack([-each, -self.surface.friction * each]),
            q=np.zeros(len(hard)),
        )

    def finger_loads(self, twists: Numbers) -> tuple[FingerLoads, FingerLoads]:
        """Return the loads of both fingers at poses of the wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, 3)
            m poses (x, z, ω_y) [m, m, rad].

        Returns
        -------
        tuple of FingerLoads
            Right finger, left finger; shapes (m, …).
        """
        x, z, turn = np.moveaxis(np.asarray(twists), -1, 0)
        # the joints are at (±b, −origin_height) of the origin; ω_y turns z toward x
        cosine, sine = np.cos(turn) - 1.0, np.sin(turn)
        inward = self.half_spacing * cosine
        deeper, across = z - self.origin_height * cosine, x - self.origin_height * sine
        aside = self.half_spacing * sine
        found = self._fingers.loads(
            np.array([inward + across, inward - across]),
            np.array([deeper - aside, deeper + aside]),
            np.array([-turn, turn]),
            np.full((len(GRIPPER_SIDES), len(x)), self.tension),
        )
        return found.of(0), found.of(1)

    def loads_at(self, twists: Numbers) -> GraspLoads:
        """Return loads e and wrenches at poses of the wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, 3)
            m poses (x, z, ω_y) [m, m, rad].

        Returns
        -------
        GraspLoads
            Wrenches on the rock about the origin of the gripper's frame G; only F_x, F_z and M_y
            differ from zero.
        """
        loads = self.finger_loads(twists)
        right, left = (side.planar_wrench for side in loads)
        wrenches = np.zeros((len(right), 6), dtype=right.dtype)
        wrenches[:, 0] = right[:, 0] - left[:, 0]
        wrenches[:, 2] = right[:, 1] + left[:, 1]
        # M_y = z F_x − x F_z; a finger's own M is from x toward z
        own = -right[:, 2] + left[:, 2] - self.origin_height * wrenches[:, 0]
        wrenches[:, 4] = own - self.half_spacing * (right[:, 1] - left[:, 1])
        elements = [side.shears for side in loads] + [side.normals for side in loads]
        reached = loads[0].reached & loads[1].reached
        return GraspLoads(np.concatenate(elements, axis=1), wrenches, reached)


def sandpaper(table: ParameterTable) -> Surface:
    """Return a tile's strength on the experiment's sandpaper: T + k P ≤ T_max and T ≥ μ P.

    T is the shear, P the pull-off, k the slope ``pull_off_slope`` and μ the friction of the table.
    """
    limit = table.scalar("gripper", "shear_limit")
    return pulled_off(Surface.from_values({"shear_limit": limit}), table)


def pulled_off(surface: Surface, table: ParameterTable) -> Surface:
    """Return a surface with its pull-off limit and friction replaced by those of the experiments.

    Parameters
    ----------
    surface : Surface
        Supplies the shear and lateral limits.
    table : ParameterTable
        Parameters from `gripper_table`.
    """
    slope = table.scalar("gripper", "pull_off_slope")
    angle = surface.pull_off_angle
    values = {
        "shear_limit": surface.shear_limit,
        "pull_off_limit": surface.shear_limit / (math.cos(angle) + slope * math.sin(angle)),
        "lateral_limit": surface.lateral_limit,
        "friction": table.scalar("gripper", "friction"),
    }
    return Surface.from_values(values)
