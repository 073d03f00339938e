"""Parameter files: every physical number with its unit and its source.

Beside this file, the hand's numbers are in ``hand.toml``, the surfaces' in ``surfaces.toml``, those
of a tile's spines in ``spines.toml``, the scatter of strengths in ``strength.toml``, those for
reading scanned rock in ``scan.toml``, those of the paper's experiments in ``experiments.toml``, and
sets of parameter values that meet the published data in ``draws.toml``. A caller's file in the form
of ``hand.toml`` may replace some or all of the hand's numbers (`hand_models.parameters.own`).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from textwrap import shorten
from typing import Any, Final, Literal, get_args

import msgspec

from hand_models.base import InvalidInputError, in_file

__all__ = [
    "ParameterTable",
    "Quantity",
    "draw_table",
    "experiment_table",
    "hand_table",
    "scan_table",
    "spine_table",
    "strength_table",
    "surface_table",
    "wall_table",
]

Source = Literal["paper", "measured", "calibrated", "assumed"]

Units = Mapping[str, Mapping[str, str]]
"""SI units by section and name of a parameter."""

LONGEST_QUOTE: Final = 200
"""Largest number of characters that an error message quotes of a parameter's entry."""


class Quantity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A number, or a list of numbers, with its unit and its source.

    Attributes
    ----------
    value : float or list of float
        The number or numbers, in ``unit``.
    unit : str
        The SI unit, ``1`` for a ratio.
    source : {'paper', 'measured', 'calibrated', 'assumed'}
        Origin of the value, which says how far to trust it.
    note : str
        Place in the source, or reason for the value.
    """

    value: float | list[float]
    unit: str
    source: Source
    note: str = ""

    def changed(self, value: float, place: int | None = None) -> Quantity:
        """Return a copy of the quantity with one number replaced.

        Parameters
        ----------
        value : float
            The new number, in the quantity's unit.
        place : int, optional
            Index of the number in a list; the first by default. A single number has no place.
        """
        if not isinstance(self.value, list):
            return msgspec.structs.replace(self, value=value)
        numbers = list(self.value)
        numbers[place or 0] = value
        return msgspec.structs.replace(self, value=numbers)


class ParameterTable:
    """Quantities by section and name; tables of the same names and values are equal.

    Parameters
    ----------
    sections : mapping of str to mapping of str to Quantity
        Quantities by section, then by name; not to be changed afterwards.
    """

    def __init__(self, sections: Mapping[str, Mapping[str, Quantity]]) -> None:
        self.sections = {name: dict(section) for name, section in sections.items()}

    @classmethod
    def read(cls, text: str, origin: str, units: Units | None = None) -> ParameterTable:
        """Parse the text of a parameter file (TOML).

        Parameters
        ----------
        text : str
        origin : str
            Name of the file, for error messages.
        units : mapping of str to mapping of str to str, optional
            Units of bare numbers, as in `of`.

        Raises
        ------
        InvalidInputError
            If the text is not TOML or an entry is not a quantity of finite numbers.
        """
        with in_file(origin):
            return cls.of(tomllib.loads(text), units)

    @classmethod
    def of(cls, raw: Mapping[str, Any], units: Units | None = None) -> ParameterTable:
        """Convert nested dictionaries, parsed from TOML or JSON, to a table.

        Parameters
        ----------
        raw : mapping of str to object
            Dictionaries with the fields of `Quantity`, by section, then by name.
        units : mapping of str to mapping of str to str, optional
            Units by section and name. With units given, an entry may be a bare number, or a list of
            numbers: in the entry's unit (``1`` where the mapping has none), with the source
            ``assumed``.

        Raises
        ------
        InvalidInputError
            If an entry is not a quantity of finite numbers; the field is its section and name.
        """
        sections: dict[str, dict[str, Quantity]] = {}
        for section, entries in raw.items():
            if not isinstance(entries, Mapping):
                raise InvalidInputError(
                    f"a section of entries is needed, got {type(entries).__name__}; put an entry "
                    "into a section",
                    field=section,
                )
            sections[section] = {
                name: _quantity(entry, f"{section}.{name}", _unit(units, section, name))
                for name, entry in entries.items()
            }
        return cls(sections)

    @classmethod
    def load(cls, path: Path, units: Units | None = None) -> ParameterTable:
        """Read a parameter file (TOML) from disk.

        Parameters
        ----------
        path : Path
        units : mapping of str to mapping of str to str, optional
            Units of bare numbers, as in `of`.

        Raises
        ------
        InvalidInputError
            If the file cannot be read, is not TOML, or an entry is not a quantity of finite
            numbers.
        """
        with in_file(str(path)):
            text = path.read_text(encoding="utf-8")
        return cls.read(text, str(path), units)

    @property
    def units(self) -> dict[str, dict[str, str]]:
        """Unit of every entry, as dictionaries by section and then by name."""
        return {
            section: {name: quantity.unit for name, quantity in quantities.items()}
            for section, quantities in self.sections.items()
        }

    def quantity(self, section: str, name: str) -> Quantity:
        """Return the number, unit and source of an entry, by its section and name.

        Raises
        ------
        InvalidInputError
            If the table has no such entry; the field is its section and name.
        """
        try:
            return self.sections[section][name]
        except KeyError:
            raise InvalidInputError("missing; must be given", field=f"{section}.{name}") from None

    def scalar(self, section: str, name: str) -> float:
        """Return the value of an entry that is a single number, in SI units.

        Parameters
        ----------
        section, name : str
            Section and name of the entry.

        Raises
        ------
        InvalidInputError
            If the table has no such entry, or the entry is a list.
        """
        value = self.quantity(section, name).value
        if isinstance(value, list):
            raise InvalidInputError(f"one number is needed, got {value}", field=f"{section}.{name}")
        return float(value)

    def positive(self, section: str, name: str) -> float:
        """Return the value of an entry that is a single number above 0, in SI units.

        Parameters
        ----------
        section, name : str
            Section and name of the entry.

        Raises
        ------
        InvalidInputError
            If the table has no such entry, or the entry is a list or not above 0.
        """
        value = self.scalar(section, name)
        if not value > 0.0:
            raise InvalidInputError(f"must be above 0, got {value:g}", field=f"{section}.{name}")
        return value

    def vector(self, section: str, name: str) -> tuple[float, ...]:
        """Return the values of an entry that is a list of numbers, in SI units.

        Parameters
        ----------
        section, name : str
            Section and name of the entry.

        Raises
        ------
        InvalidInputError
            If the table has no such entry, or the entry is a single number.
        """
        value = self.quantity(section, name).value
        if not isinstance(value, list):
            raise InvalidInputError(
                f"a list of numbers is needed, got {value:g}", field=f"{section}.{name}"
            )
        return tuple(float(v) for v in value)

    def __iter__(self) -> Iterator[tuple[str, str, Quantity]]:
        for section, quantities in self.sections.items():
            for name, quantity in quantities.items():
                yield section, name, quantity

    def replaced(self, other: ParameterTable) -> ParameterTable:
        """Return a copy of this table with the entries of ``other`` added or put in place."""
        sections = {name: dict(section) for name, section in self.sections.items()}
        for section, name, quantity in other:
            sections.setdefault(section, {})[name] = quantity
        return ParameterTable(sections)

    def difference(self, other: ParameterTable) -> ParameterTable:
        """Return the entries of this table that ``other`` lacks or has another value for."""
        sections: dict[str, dict[str, Quantity]] = {}
        for section, name, quantity in self:
            theirs = other.sections.get(section, {}).get(name)
            if theirs is None or theirs.value != quantity.value:
                sections.setdefault(section, {})[name] = quantity
        return ParameterTable(sections)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ParameterTable) and self.sections == other.sections

    def __hash__(self) -> int:
        # equal tables have equal names and values, in whatever order
        return hash(
            frozenset(
                (section, name, tuple(q.value) if isinstance(q.value, list) else q.value)
                for section, name, q in self
            )
        )


def _unit(units: Units | None, section: str, name: str) -> str | None:
    return None if units is None else units.get(section, {}).get(name, "1")


def _quantity(raw: Any, field: str, unit: str | None) -> Quantity:
    """Return an entry; ``unit``: of a bare number, None where there may be none."""
    # to Python a truth value is a number
    if unit is not None and isinstance(raw, int | float | list) and not isinstance(raw, bool):
        raw = {"value": raw, "unit": unit, "source": "assumed"}
    try:
        quantity = msgspec.convert(raw, Quantity)
    except msgspec.ValidationError as error:
        raise _refusal(raw, str(error), field) from None
    value = quantity.value
    numbers = enumerate(value) if isinstance(value, list) else [(None, value)]
    for i, number in numbers:
        if not math.isfinite(number):
            place = f"{field}.value" if i is None else f"{field}.value[{i}]"
            raise InvalidInputError(f"must be finite, got {number}", field=place)
    return quantity


def _refusal(raw: Any, complaint: str, field: str) -> InvalidInputError:
    """Return the error of an entry that is no quantity, from msgspec's complaint about it."""
    valid_parts = {
        "value": "a number or a list of numbers",
        "unit": "text",
        "source": f"one of {', '.join(get_args(Source))}",
        "note": "text",
    }
    for name, valid in valid_parts.items():
        # msgspec ends in the place of what is wrong
        if isinstance(raw, Mapping) and f"`$.{name}" in complaint:
            got = repr(raw[name])
            got = got if len(got) <= LONGEST_QUOTE else f"{got[:LONGEST_QUOTE]} …"
            return InvalidInputError(f"must be {valid}, got {got}", field=f"{field}.{name}")
    form = "{ value, unit, source, note (optional) }"
    said = shorten(complaint.replace("`", ""), LONGEST_QUOTE, placeholder=" …")
    return InvalidInputError(f"{said[:1].lower()}{said[1:]}; an entry is {form}", field=field)


@cache
def bundled_table(name: str, package: str = "hand_models.parameters") -> ParameterTable:
    """Return the parameters of a bundled file; each file is read once.

    Parameters
    ----------
    name : str
        Name of the file, such as ``hand.toml``.
    package : str, optional
        Package in which it is.
    """
    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    return ParameterTable.read(text, name)


def hand_table() -> ParameterTable:
    """Return the bundled parameters of the SpinyHand, from ``hand.toml``."""
    return bundled_table("hand.toml")


def surface_table() -> ParameterTable:
    """Return the bundled parameters of the surfaces, from ``surfaces.toml``."""
    return bundled_table("surfaces.toml")


def experiment_table() -> ParameterTable:
    """Return the parameters of the paper's experiments, from ``experiments.toml``."""
    return bundled_table("experiments.toml")


def scan_table() -> ParameterTable:
    """Return the parameters for reading scanned rock, from ``scan.toml``."""
    return bundled_table("scan.toml")


def spine_table() -> ParameterTable:
    """Return the parameters of a tile's spines and the rock's asperities, from ``spines.toml``."""
    return bundled_table("spines.toml")


def strength_table() -> ParameterTable:
    """Return how the strengths of tiles scatter, from ``strength.toml``."""
    return bundled_table("strength.toml")


def wall_table() -> ParameterTable:
    """Return the numbers of generated walls, by their names, from ``walls.toml``."""
    return bundled_table("walls.toml")


def draw_table() -> ParameterTable:
    """Return the fitted sets and the ranges from which samples are made, from ``draws.toml``."""
    return bundled_table("draws.toml")
