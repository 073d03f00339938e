"""Axes and fixed conditions of a sweep: entries of the gripper's table, rock and tension."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass, replace

import numpy as np

from hand_models.base import InvalidInputError, errors_under
from hand_models.compliance import Gripper, pulled_off
from hand_models.parameters import (
    LARGEST_BY_UNIT,
    ParameterTable,
    Quantity,
    experiment_table,
    hand_table,
    own_hand,
)
from hand_models.tile import Surface

__all__ = ["Axis", "Conditions"]


@dataclass(frozen=True)
class Conditions:
    """Rock and tension of a gripper in a sweep.

    Attributes
    ----------
    diameter : float
        Diameter of the round rock [m].
    tension : float
        Tension of both tendons [N].
    surface : str
        Name of the preset surface.
    """

    diameter: float
    tension: float
    surface: str = "concrete-fine"  # of Figs. 15 and 16

    @classmethod
    def of_figure(cls, figure: str) -> Conditions:
        """Return the conditions of a figure of the experiments on sandpaper, such as ``fig12``."""
        settings = experiment_table()
        return cls(
            settings.scalar(figure, "diameter"), settings.scalar(figure, "tension"), "sandpaper-36"
        )

    @classmethod
    def of_fig16(cls) -> tuple[Conditions, ...]:
        """Return the two conditions of Fig. 16: surface A, then surface B."""
        settings = experiment_table()
        tension = settings.scalar("fig16", "tension")
        return tuple(cls(d, tension) for d in settings.vector("parameter_studies", "diameters"))

    def gripper(self, table: ParameterTable, most_pressing: float = math.inf) -> Gripper:
        """Return a gripper under these conditions.

        Parameters
        ----------
        table : ParameterTable
            Parameters of the gripper.
        most_pressing : float, optional
            Largest force with which the gripper presses on the rock [N].

        Raises
        ------
        InvalidInputError
            If a number is out of range, there is no such surface, or the fingers do not lie on the
            rock.
        """
        surface = None
        # what the paper's experiments publish of sandpaper replaces the preset's numbers
        if self.surface != "sandpaper-36":
            with errors_under("surface"):
                surface = pulled_off(Surface.named(self.surface), table)
        return Gripper(self.diameter, self.tension, surface, table, most_pressing)


@dataclass(frozen=True)
class Axis:
    """An entry of the gripper's table, and the values that it takes in a sweep.

    Attributes
    ----------
    section, name : str
        Section and name of the entry.
    index : int or None
        Index of the number, for an entry that is a list.
    values : tuple of float
        Values of the entry in the sweep, ascending, in SI units.
    unit : str
        SI unit of the values.
    """

    section: str
    name: str
    index: int | None
    values: tuple[float, ...]
    unit: str

    @property
    def entry(self) -> str:
        """Name of the axis's entry: ``section.name``, or ``section.name[i]`` in a list."""
        place = "" if self.index is None else f"[{self.index}]"
        return f"{self.section}.{self.name}{place}"

    @classmethod
    def parse(cls, text: str, table: ParameterTable, surface: str) -> Axis:
        """Parse ``SECTION.NAME=LOW:HIGH:N``, or ``SECTION.NAME[i]=LOW:HIGH:N`` of a list.

        Parameters
        ----------
        text : str
            LOW and HIGH in SI units, and N, the number of values from LOW to HIGH.
        table : ParameterTable
            Parameters of the gripper.
        surface : str
            Name of the surface, which decides which entries a gripper reads.

        Raises
        ------
        InvalidInputError
            If the text is not of this form, the gripper reads no such entry, or the entry cannot
            have such values.
        """
        entry, _, span = text.partition("=")
        try:
            ends, count = [float(end) for end in span.split(":")[:-1]], int(span.split(":")[-1])
            low, high = ends
        except ValueError:
            raise InvalidInputError(
                f"must be SECTION.NAME=LOW:HIGH:N or SECTION.NAME[i]=LOW:HIGH:N, got {text!r}"
            ) from None
        known = _entries(table, surface)
        if entry not in known:
            like = difflib.get_close_matches(entry, known)
            hint = f"; did you mean {' or '.join(like)}?" if like else ""
            listed = ", ".join(sorted(known))
            raise InvalidInputError(
                f"the gripper has no parameter {entry!r}{hint}; known are {listed}"
            )
        axis = known[entry]
        bundled = table.quantity(axis.section, axis.name).value
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InvalidInputError(
                f"LOW and HIGH must be finite, and LOW below HIGH, got {low:g}:{high:g}",
                field=entry,
            )
        if low < 0.0 <= np.min(bundled):
            raise InvalidInputError(f"LOW must not be negative, got {low:g}", field=entry)
        if high > (most := LARGEST_BY_UNIT.get(axis.unit, math.inf)):
            raise InvalidInputError(
                f"HIGH must not exceed {most:.4g} {axis.unit}, got {high:g}", field=entry
            )
        if not 2 <= count <= 201:
            raise InvalidInputError(f"N must be from 2 to 201, got {count}", field=entry)
        if axis.section in hand_table().sections:
            for value in (low, high):
                changed = axis.set(table, value).quantity(axis.section, axis.name)
                own_hand(ParameterTable({axis.section: {axis.name: changed}}))
        return replace(axis, values=tuple(np.linspace(low, high, count).tolist()))

    def set(self, table: ParameterTable, value: float) -> ParameterTable:
        """Return a copy of a table in which the axis's entry has the given value, in SI units."""
        quantity = table.quantity(self.section, self.name).changed(value, self.index)
        return table.replaced(ParameterTable({self.section: {self.name: quantity}}))

    def current(self, table: ParameterTable) -> float:
        """Return the value that the axis's entry has in a parameter table, in SI units."""
        value = table.quantity(self.section, self.name).value
        return float(value[self.index or 0] if isinstance(value, list) else value)


class _Read(ParameterTable):
    """A table that remembers what was read of it."""

    def __init__(self, table: ParameterTable) -> None:
        super().__init__(table.sections)
        self.entries: set[tuple[str, str]] = set()

    def quantity(self, section: str, name: str) -> Quantity:
        self.entries.add((section, name))
        return super().quantity(section, name)


def _entries(table: ParameterTable, surface: str) -> dict[str, Axis]:
    """Return the numbers that a gripper reads, by a caller's names, still without values."""
    reading = _Read(table)
    settings = experiment_table()
    diameter = settings.vector("parameter_studies", "diameters")[0]
    Conditions(diameter, settings.scalar("fig16", "tension"), surface).gripper(reading)
    # read, but of no effect: the gripper has no base tile
    idle = {("tile", "base_engagement")}
    axes = [
        Axis(section, name, index, (), quantity.unit)
        for section, name, quantity in table
        if (section, name) in reading.entries - idle
        for index in (range(len(quantity.value)) if isinstance(quantity.value, list) else (None,))
    ]
    return {axis.entry: axis for axis in axes}
