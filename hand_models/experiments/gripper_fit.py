"""Data of Figs. 12 to 14 on the paper's gripper, and the residuals of the model's parameters.

Each datum has a tolerance, and a residual is the model's difference from the datum in tolerances.
First come the ends of Fig. 12's lines (a tenth, or 0.3 N), the extents of Fig. 13 (a tenth) and the
edge of its surface seen along F_z (0.2 N·m everywhere, 0.1 on average); the misfit of a set of
parameters is the largest of these residuals. Further data, with wide tolerances, do not count in
the misfit: the surface's side view and the best planes of loading. Wrenches are those really held,
as far as the paper's surface goes: none that press more than that.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, CruxError, SolverError
from hand_models.compliance import PLANAR_COMPONENTS, Gripper, boundary, gripper_table, linear_box
from hand_models.experiments.pulling import held_wrenches, pulled_off_poses
from hand_models.experiments.sweep_axis import Axis, Conditions
from hand_models.experiments.wrench_hull import edge, extents, in_paper_signs, with_mirrored
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["FIT_TOLERANCES", "Datum", "FitTolerances", "GripperFit"]


@dataclass(frozen=True, slots=True)
class FitTolerances:
    """Tolerances of the data that are read off Figs. 12 and 13."""

    force_share: float = 0.1
    """Tolerance of a force of Fig. 12 or an extent of Fig. 13, as a share of its value."""
    least_force: float = 0.3
    """Least tolerance of a force of Fig. 12 [N]."""
    edge: float = 0.2
    edge_on_average: float = 0.1
    """Tolerances of the edge of Fig. 13's surface, at every point and on average [N·m]."""


FIT_TOLERANCES: Final = FitTolerances()

DATA_DIRECTIONS: Final = np.array(
    [
        (1.0, 0.0, 0.0),
        (1.0, 0.0, 0.5),
        (1.0, 0.0, 1.0),
        (0.5, 0.0, 1.0),
        (0.3, 0.0, 1.0),
        (0.0, 0.0, 1.0),
        (-0.5, 0.0, 1.0),
        (-1.0, 0.0, 1.0),
        (-1.0, 0.0, 0.5),
        (1.0, 0.0, -0.3),
        (0.0, -1.0, 0.0),
        (0.5, -1.0, 0.0),
        (1.0, -1.0, 0.0),
        (1.0, -0.5, 0.0),
        (1.0, -0.5, 0.3),
    ]
)
"""Directions (15, 3) along F_x, F_z and M_y over the extents of Fig. 13, in the paper's signs, in
which `GripperFit.wrenches` searches.
"""


class Datum(NamedTuple):
    """One number that the paper's figures give.

    Attributes
    ----------
    label, unit : str
        Text for the datum, and unit of its value.
    wanted, tolerance : float
        Value in the figure, and its tolerance, in the unit.
    first : bool
        True if the datum counts in the misfit.
    """

    label: str
    unit: str
    wanted: float
    tolerance: float
    first: bool


def _numbers() -> tuple[Axis, ...]:
    """Return the gripper's numbers to be found, each from the least to the most plausible."""
    one, each = (None,), range(len(PHALANGES))
    places: dict[str, tuple[str, str, Iterable[int | None]]] = {
        "tile_height": ("finger", "tile_height", one),
        "seated_contact": ("finger", "seated_contact", one),
        "middle_radius": ("finger", "pulley_radii", (1,)),
        "distal_radius": ("finger", "pulley_radii", (2,)),
        "engagement": ("tile", "engagement", each),
        "contact_stiffness": ("tile", "contact_stiffness", each),
    }
    table, found = experiment_table(), []
    for plausible, quantity in table.sections["calibration"].items():
        section, name, indices = places.get(plausible, ("gripper", plausible, one))
        ends = table.vector("calibration", plausible)
        found += [Axis(section, name, index, ends, quantity.unit) for index in indices]
    return tuple(found)


class GripperFit:
    """Residuals of the paper's data as functions of the gripper's uncertain parameters.

    A set of parameters is x, shape (n,): each parameter as a share, 0 to 1, of its plausible range.

    Parameters
    ----------
    table : ParameterTable, optional
        All parameters of the gripper, of which some are fitted; `gripper_table` by default.

    Attributes
    ----------
    numbers : tuple of Axis, length n
        The fitted parameters, with the ends of their plausible ranges.
    names : list of str, length n
        Name of each parameter without its section, such as ``pulley_radii[1]``.
    low, width : ndarray, shape (n,)
        Lower end and width of each range, in SI units.
    data : tuple of Datum, length k
    wanted, tolerance, first : ndarray, shape (k,)
        Attributes of the data, as arrays.
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        self.table = table or gripper_table()
        self.numbers = _numbers()
        self.names = [number.entry.partition(".")[2] for number in self.numbers]
        self.low, high = np.array([number.values for number in self.numbers]).T
        self.width = high - self.low
        self._settings = settings = experiment_table()
        self._edge_at = np.array(settings.vector("fig13", "edge_force_x"))
        self._edge = np.array(settings.vector("fig13", "edge_moment"))
        self.data = tuple(self._data())
        self.wanted = np.array([datum.wanted for datum in self.data])
        self.tolerance = np.array([datum.tolerance for datum in self.data])
        self.first = np.array([datum.first for datum in self.data])

    def _data(self) -> Iterable[Datum]:
        settings, near = self._settings, FIT_TOLERANCES
        for end in ("unloaded", "pulled"):
            for kind in ("shear", "normal"):
                values = settings.vector("fig12", f"{kind}_{end}")
                for phalanx, value in zip(PHALANGES, values, strict=True):
                    tolerance = max(near.force_share * abs(value), near.least_force)
                    yield Datum(f"{phalanx} {kind}, {end}", "N", value, tolerance, True)
        for name, words, unit in (
            ("force_x", "F_x", "N"),
            ("force_z", "F_z", "N"),
            ("moment", "M_y", "N·m"),
        ):
            value = settings.scalar("fig13", name)
            yield Datum(f"extent of {words}", unit, value, near.force_share * abs(value), True)
        for force, moment in zip(self._edge_at.tolist(), self._edge.tolist(), strict=True):
            yield Datum(f"edge at F_x = {force:g} N", "N·m", moment, near.edge, True)
        yield Datum("edge, off on average", "N·m", 0.0, near.edge_on_average, True)
        side = settings.scalar("fig13", "side_force_z")
        words = f"pull-off at F_x = {settings.scalar('fig13', 'side_force_x'):g} N"
        # neither counts in the misfit: the side view may be off by all of it, an arm by 0.4
        yield Datum(words, "N", side, abs(side), False)
        for kind in ("force", "moment"):
            arm = 1.0 / settings.scalar("fig14", f"{kind}_ratio")
            yield Datum(f"M_y : F_x best for {kind}", "m", arm, 0.4 * arm, False)

    def start(self) -> Array:
        """Return the parameters' values in ``table`` as shares x, (n,), of their plausible ranges.

        Values outside a range are clipped to its ends, 0 and 1.
        """
        now = [number.current(self.table) for number in self.numbers]
        return np.asarray(np.clip((np.array(now) - self.low) / self.width, 0.0, 1.0))

    def values(self, x: Array) -> Array:
        """Convert shares x (n,) of plausible ranges to parameters in SI units, shape (n,)."""
        return np.asarray(self.low + self.width * x)

    def gripper(self, x: Array) -> Gripper:
        """Return the gripper with given parameters, on the surface of Fig. 13.

        Parameters
        ----------
        x : ndarray, shape (n,)
            Parameters as shares of their plausible ranges.

        Raises
        ------
        InvalidInputError
            If the fingers do not lie on the surface.
        """
        table, settings = self.table, self._settings
        for number, value in zip(self.numbers, self.values(x).tolist(), strict=True):
            table = number.set(table, value)
        return Conditions.of_figure("fig13").gripper(table, settings.scalar("fig13", "top"))

    def wrenches(self, gripper: Gripper, *, fine: bool = False) -> Array:
        """Return the outermost wrenches that a gripper holds, (F_x, F_z, M_y) in the paper's signs.

        Parameters
        ----------
        gripper : Gripper
        fine : bool, optional
            True to search on the grid of the studies; False to follow rays, which is faster and
            some per cent less accurate.

        Returns
        -------
        ndarray, shape (k, 3)
            Wrenches, with their mirror images [N, N, N·m].
        """
        if fine:
            return held_wrenches(gripper)
        toward = np.zeros((len(DATA_DIRECTIONS), 6))
        size = [self._settings.scalar("fig13", n) for n in ("force_x", "force_z", "moment")]
        toward[:, PLANAR_COMPONENTS] = DATA_DIRECTIONS / np.abs(size) * (1.0, 1.0, -1.0)
        found = boundary(
            gripper, linear_box(gripper), 350, toward
        )  # of the rays, some per cent off
        # the fine hull's wrenches are larger than those of the rays by about 0.8 %
        return with_mirrored(in_paper_signs(found.wrenches) * 1.008)

    def model(self, x: Array, *, fine: bool = False) -> Array:
        """Return the model's value of each of the paper's data, for a set of parameters.

        Parameters
        ----------
        x : ndarray, shape (n,)
            Parameters as shares of their plausible ranges.
        fine : bool, optional
            As in `wrenches`.

        Returns
        -------
        ndarray, shape (k,)
            Model's value of each datum, in its unit.

        Raises
        ------
        CruxError
            If the fingers do not lie on the surface, or no pose of the wrist holds.
        """
        gripper, settings = self.gripper(x), self._settings
        pull = settings.scalar("fig12", "pull")
        poses = pulled_off_poses(gripper, np.array([0.0, pull]))
        if len(poses) < 2:
            raise SolverError(
                f"no equilibrium found for a pull of {pull:g} N (fig12.pull) on the gripper: "
                "lower the pull"
            )
        loads, _ = gripper.finger_loads(poses)
        held = self.wrenches(gripper, fine=fine)
        # of F_x and M_y, and of F_x and −F_z
        along_z = edge(held[:, [0, 2]], self._edge_at)
        down = held[:, [0, 1]] * (1.0, -1.0)
        side = -edge(down, np.array([settings.scalar("fig13", "side_force_x")]))
        strengths = np.hypot(held[:, 0], held[:, 1]), np.abs(held[:, 2])
        best = [held[strength.argmax()] for strength in strengths]
        off = float(np.abs(along_z - self._edge).mean())
        arms = [moment / force_x for force_x, _, moment in best]
        lines = np.hstack([loads.shears, loads.normals]).ravel()
        return np.array([*lines, *extents(held), *along_z, off, *side, *arms])

    def residuals(self, x: Array, *, fine: bool = False) -> Array:
        """Return the residuals of the data for a set of parameters: (model − wanted) / tolerance.

        Parameters
        ----------
        x : ndarray, shape (n,)
            Parameters as shares of their plausible ranges.
        fine : bool, optional
            As in `wrenches`.

        Returns
        -------
        ndarray, shape (k,)
            Clipped to ±30; all are 30 where the parameters give no gripper that holds.
        """
        hopeless = 30.0  # of every datum where a set of numbers gives no gripper that holds
        try:
            off = (self.model(x, fine=fine) - self.wanted) / self.tolerance
        except CruxError:
            return np.full(len(self.data), hopeless)
        return np.asarray(np.nan_to_num(np.clip(off, -hopeless, hopeless), nan=hopeless))

    def misfit(self, residuals: Array) -> float:
        """Return the largest absolute residual of those data that count in the misfit.

        Parameters
        ----------
        residuals : ndarray, shape (k,)
            Result of `residuals` [tolerances].
        """
        return float(np.abs(residuals[self.first]).max())
