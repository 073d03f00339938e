"""Data of Figs. 12 to 14 on the paper's gripper, and the model's values of them.

Wrenches are those of straight pulls, as in the paper's experiment: the direction is held until a
tile slips. Data of Fig. 13 are the model's reach over the figure's, 1 where they agree, along the
axes, toward the edge of its surface seen along F_z and toward the edge of its side view. A datum's
variance is e² + (δ s)², with e the error with which its figure can be read, s the datum's magnitude
and δ the model's discrepancy, its relative error.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np

from hand_models.base import Array, CruxError, SolverError
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments.pulling import pull, pulled_off_poses
from hand_models.experiments.sweep_axis import Axis, Conditions
from hand_models.experiments.wrench_hull import extents, reach_toward, with_mirrored
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table

__all__ = [
    "FITTED_FIGURES",
    "FIT_TOLERANCES",
    "READING_ERRORS",
    "Datum",
    "FitTolerances",
    "GripperFit",
    "ReadingErrors",
]

FITTED_FIGURES: Final = ("fig12", "fig13", "fig14")
"""Figures of the paper whose data are fitted."""


@dataclass(frozen=True, slots=True)
class ReadingErrors:
    """Standard deviations with which data are read off the paper's figures.

    A figure that is good to ± w has w / √3, as of an even distribution.
    """

    force: float = 0.17
    """Of a force of Fig. 12, whose lines are good to 0.3 N [N]."""
    extent: float = 0.012
    """Of an extent of Fig. 13, good to 2 % of the axis."""
    edge: float = 0.075
    """Of a moment of the edge of Fig. 13's surface, good to 0.13 N·m [N·m]."""
    side: float = 0.4 / 3.0**0.5
    """Of a force of Fig. 13's side view, good to 2 % of 20 N [N]."""
    least_size: float = 2.0
    """Least magnitude of a force of Fig. 12: of what differs in it between phalanges [N]."""
    ratio: float = 0.15
    """Of a best ratio of Fig. 14, which is printed as about, as a share: good to a quarter."""


READING_ERRORS: Final = ReadingErrors()


@dataclass(frozen=True, slots=True)
class FitTolerances:
    """Tolerances within which a claim of Fig. 12 or 13 counts as met."""

    force_share: float = 0.1
    """Of a force of Fig. 12 or an extent of Fig. 13, as a share of its value."""
    least_force: float = 0.3
    """Least tolerance of a force of Fig. 12 [N]."""
    edge: float = 0.2
    edge_on_average: float = 0.1
    """Of the edge of Fig. 13's surface, at every point and on average [N·m]."""


FIT_TOLERANCES: Final = FitTolerances()


class PullDirections:
    """Directions of straight pulls, over Fig. 13's extents.

    Steps of 8 degrees, where the best ratios are: a parabola through three of them is good to 1 %.
    """

    angles: ClassVar[Array] = np.radians(
        [*range(-30, 0, 15), *range(0, 100, 8), *range(105, 150, 15)]
    )
    """From F_x to M_y [rad]."""
    depths: ClassVar[tuple[float, ...]] = (0.0, -0.15, -0.4)
    """Shares of F_z."""


class Datum(NamedTuple):
    """One number that the paper's figures give.

    Attributes
    ----------
    label, unit, figure : str
    wanted, reading : float
        Value in the figure, and the standard deviation of reading it, in the unit.
    """

    label: str
    unit: str
    figure: str
    wanted: float
    reading: float


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
    """The paper's data as functions of the gripper's uncertain parameters.

    A set of parameters is x, shape (n,): each parameter as a share, 0 to 1, of its plausible range.

    Parameters
    ----------
    table : ParameterTable, optional
        From `gripper_table`, with all other parameters.

    Attributes
    ----------
    numbers : tuple of Axis, length n
        The parameters, with the ends of their plausible ranges.
    names : list of str, length n
    low, width : ndarray, shape (n,)
        Lower end and width of each range, in SI units.
    data : tuple of Datum, length k
    wanted, reading, size : ndarray, shape (k,)
        Values, errors of reading and magnitudes s of the data, in their units.
    figures : ndarray of str, shape (k,)
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        self.table = table or gripper_table()
        self.numbers = _numbers()
        self.names = [number.entry.partition(".")[2] for number in self.numbers]
        self.low, high = np.array([number.values for number in self.numbers]).T
        self.width = high - self.low
        self._settings = settings = experiment_table()
        self._size = np.array([settings.scalar("fig13", n) for n in ("force_x", "moment")])
        self._depth = abs(settings.scalar("fig13", "force_z"))
        self._edge = np.column_stack(
            [settings.vector("fig13", n) for n in ("edge_force_x", "edge_moment")]
        )
        self._side = np.array(
            [[settings.scalar("fig13", n) for n in ("side_force_x", "side_force_z")]]
        )
        self.data = tuple(self._data())
        self.wanted = np.array([datum.wanted for datum in self.data])
        self.reading = np.array([datum.reading for datum in self.data])
        self.figures = np.array([datum.figure for datum in self.data])
        of_12 = np.array([datum.unit == "N" for datum in self.data])
        # a small force is the difference of large ones
        self.size = np.maximum(np.abs(self.wanted), np.where(of_12, READING_ERRORS.least_size, 0.0))

    def _data(self) -> Iterable[Datum]:
        settings, near = self._settings, READING_ERRORS
        for end in ("unloaded", "pulled"):
            for kind in ("shear", "normal"):
                values = settings.vector("fig12", f"{kind}_{end}")
                for phalanx, value in zip(PHALANGES, values, strict=True):
                    yield Datum(f"{phalanx} {kind}, {end}", "N", "fig12", value, near.force)
        for words in ("F_x", "F_z", "M_y"):
            yield Datum(f"extent of {words}", "1", "fig13", 1.0, near.extent)
        moment, depth = self._size[1], self._depth
        for place in self._edge:
            far = float(np.linalg.norm(place / self._size))
            words = f"edge at F_x = {place[0]:g} N, M_y = {place[1]:g} N·m"
            yield Datum(words, "1", "fig13", 1.0, near.edge / moment / far)
        far = float(np.linalg.norm(self._side[0] / (self._size[0], depth)))
        words = "side at F_x = {:g} N, F_z = {:g} N".format(*self._side[0])
        yield Datum(words, "1", "fig13", 1.0, near.side / depth / far)
        for kind in ("force", "moment"):
            arm = 1.0 / settings.scalar("fig14", f"{kind}_ratio")
            yield Datum(f"M_y : F_x best for {kind}", "m", "fig14", arm, near.ratio * arm)

    def start(self) -> Array:
        """Return the values in `table` as shares x, shape (n,), of their plausible ranges.

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

    def pulled(self, gripper: Gripper) -> Array:
        """Return the last wrenches of straight pulls that hold, with their mirror images.

        Returns
        -------
        ndarray, shape (m, 3)
            (F_x, F_z, M_y) in the paper's signs [N, N, N·m]; the first is the pull straight off.

        Raises
        ------
        EmptySetError
            If the closed gripper exceeds a limit without load.
        """
        angles = PullDirections.angles
        flat = np.column_stack([np.cos(angles), np.sin(angles)]) * self._size
        ways = [(x, z * self._depth, m) for z in PullDirections.depths for x, m in flat]
        return with_mirrored(pull(gripper, np.array([(0.0, -1.0, 0.0), *ways])).wrenches)

    def model(self, x: Array) -> Array:
        """Return the model's value of each of the paper's data, for a set of parameters.

        Parameters
        ----------
        x : ndarray, shape (n,)
            Parameters as shares of their plausible ranges.

        Returns
        -------
        ndarray, shape (k,)
            In the units of the data.

        Raises
        ------
        CruxError
            If the fingers do not lie on the surface, or no pose of the wrist holds.
        """
        gripper, settings = self.gripper(x), self._settings
        load = settings.scalar("fig12", "pull")
        poses = pulled_off_poses(gripper, np.array([0.0, load]))
        if len(poses) < 2:
            raise SolverError(
                f"no equilibrium found for a pull of {load:g} N (fig12.pull) on the gripper: "
                "lower the pull"
            )
        loads, _ = gripper.finger_loads(poses)
        held = self.pulled(gripper)
        most = extents(held)
        reach = np.array([most.force_x, held[0, 1], most.moment]) / (
            self._size[0],
            -self._depth,
            self._size[1],
        )
        edges = reach_toward(held[:, [0, 2]], self._edge)
        side = reach_toward(held[:, [0, 1]], self._side)
        lines = np.hstack([loads.shears, loads.normals]).ravel()
        return np.array([*lines, *reach, *edges, *side, *_best_arms(held)])

    def models(self, sets: Array) -> Array:
        """Return the values of `model` of m sets (m, n), shape (m, k); NaN where there are none."""
        found = np.full((len(sets), len(self.data)), np.nan)
        for i, x in enumerate(sets):
            try:
                found[i] = self.model(x)
            except CruxError:
                continue
        return found

    def deviations(self, discrepancy: float) -> Array:
        """Return standard deviations (k,) of the data about the model, in the data's units.

        Parameters
        ----------
        discrepancy : float
            δ, relative error of the model [1].
        """
        return np.asarray(np.hypot(self.reading, discrepancy * self.size))


def _best_arms(held: Array) -> list[float]:
    """Return M_y : F_x at which pulls near the rock are best for force and for moment [m].

    Between directions of pulls it is where a parabola through the three best of them is highest.
    """
    angles, depths = PullDirections.angles, len(PullDirections.depths)
    count = len(angles)
    flat = held[1 : 1 + depths * count].reshape(depths, count, 3)
    arms = []
    for strength in (np.hypot(flat[..., 0], flat[..., 1]), np.abs(flat[..., 2])):
        most = strength.max(axis=0)
        i = int(np.clip(most.argmax(), 1, count - 2))
        near = angles[i - 1 : i + 2] - angles[i]
        curve, slope, _ = np.polyfit(near, most[i - 1 : i + 2], 2)
        turn = np.clip(-0.5 * slope / curve, near[0], near[2]) if curve < 0.0 else 0.0
        # a moment alone has no ratio: an arm of 0.4 m stands for it
        arms.append(float(np.tan(min(angles[i] + turn, 1.5))))
    settings = experiment_table()
    arm = settings.scalar("fig13", "moment") / settings.scalar("fig13", "force_x")
    return [each * arm for each in arms]
