"""Parameter files: every physical number with its unit and its source.

The hand's numbers are in ``hand.toml``, the surfaces' in ``surfaces.toml``, those of a tile's
spines in ``spines.toml``, those of reading scanned rock in ``scan.toml``, those of the paper's
experiments in ``experiments.toml``, beside this file. A caller's own file in the same form may
replace some or all of them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from hand_models.errors import InvalidInputError

__all__ = [
    "ParameterTable",
    "Quantity",
    "experiment_table",
    "hand_table",
    "scan_table",
    "spine_table",
    "surface_table",
]

Source = Literal["paper", "measured", "calibrated", "assumed"]


class Quantity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A number, or a list of numbers, with where it comes from.

    Attributes
    ----------
    value : float or list of float
        In SI units.
    unit : str
        The SI unit, ``1`` for a ratio.
    source : {'paper', 'measured', 'calibrated', 'assumed'}
        How far to trust it.
    note : str
        Where exactly, or why.
    """

    value: float | list[float]
    unit: str
    source: Source
    note: str = ""


class ParameterTable:
    """Quantities by section and name.

    Parameters
    ----------
    sections : mapping of str to mapping of str to Quantity
    """

    def __init__(self, sections: Mapping[str, Mapping[str, Quantity]]) -> None:
        self.sections = {name: dict(section) for name, section in sections.items()}

    @classmethod
    def read(cls, text: str, origin: str) -> ParameterTable:
        """Parse a parameter file.

        Raises
        ------
        InvalidInputError
            If the text is not TOML or an entry is not a quantity of finite numbers.
        """
        try:
            raw: dict[str, Any] = tomllib.loads(text)
            table = cls(msgspec.convert(raw, dict[str, dict[str, Quantity]]))
        except (tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
            raise InvalidInputError(str(error), field=origin) from None
        for section, name, quantity in table:
            if not np.isfinite(quantity.value).all():
                raise InvalidInputError(
                    f"{section}.{name} must be finite, got {quantity.value}", field=origin
                )
        return table

    @classmethod
    def load(cls, path: Path) -> ParameterTable:
        """Read a parameter file from disk."""
        return cls.read(path.read_text(encoding="utf-8"), str(path))

    def quantity(self, section: str, name: str) -> Quantity:
        """Return one quantity.

        Raises
        ------
        InvalidInputError
            If there is none of that name.
        """
        try:
            return self.sections[section][name]
        except KeyError:
            raise InvalidInputError("missing parameter", field=f"{section}.{name}") from None

    def scalar(self, section: str, name: str) -> float:
        """Return a single number in SI units."""
        value = self.quantity(section, name).value
        if isinstance(value, list):
            raise InvalidInputError("one number is needed, not a list", field=f"{section}.{name}")
        return float(value)

    def vector(self, section: str, name: str) -> tuple[float, ...]:
        """Return a list of numbers in SI units."""
        value = self.quantity(section, name).value
        if not isinstance(value, list):
            raise InvalidInputError("a list of numbers is needed", field=f"{section}.{name}")
        return tuple(float(v) for v in value)

    def __iter__(self) -> Iterator[tuple[str, str, Quantity]]:
        for section, quantities in self.sections.items():
            for name, quantity in quantities.items():
                yield section, name, quantity

    def replaced(self, other: ParameterTable) -> ParameterTable:
        """Return this table with the entries of ``other`` in place of its own."""
        sections = {name: dict(section) for name, section in self.sections.items()}
        for section, name, quantity in other:
            sections.setdefault(section, {})[name] = quantity
        return ParameterTable(sections)


def _bundled(name: str) -> ParameterTable:
    text = resources.files("hand_models.parameters").joinpath(name).read_text(encoding="utf-8")
    return ParameterTable.read(text, name)


@cache
def hand_table() -> ParameterTable:
    """Return the numbers of the SpinyHand, ``hand.toml``."""
    return _bundled("hand.toml")


@cache
def surface_table() -> ParameterTable:
    """Return the numbers of the surfaces, ``surfaces.toml``."""
    return _bundled("surfaces.toml")


@cache
def experiment_table() -> ParameterTable:
    """Return the numbers of the paper's experiments, ``experiments.toml``."""
    return _bundled("experiments.toml")


@cache
def scan_table() -> ParameterTable:
    """Return the numbers of scanned rock, ``scan.toml``."""
    return _bundled("scan.toml")


@cache
def spine_table() -> ParameterTable:
    """Return the numbers of a tile's spines and of the rock's asperities, ``spines.toml``."""
    return _bundled("spines.toml")
