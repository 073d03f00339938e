"""Parameters of a caller's hand or surfaces: check entries that replace some of the bundled ones.

The bundled table must have the entry, in the same unit and shape, and with a sign and size that are
possible. Combinations of numbers are checked by the models that read them, but for the widths of
fingers, of which rock is cut without a model of a finger.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from textwrap import shorten
from typing import Final

import numpy as np
from msgspec import structs

from hand_models.base import InvalidInputError, in_file
from hand_models.parameters.tables import (
    LONGEST_QUOTE,
    ParameterTable,
    Quantity,
    hand_table,
    surface_table,
)

__all__ = ["check_widths", "load_own_hand", "own_hand", "own_surfaces"]

LARGEST_BY_UNIT: Final = {"m": 1.0, "rad": 2.0 * math.pi}
"""Largest magnitude of a hand's parameter, by unit; a larger one is in millimetres or degrees."""


def load_own_hand(path: Path) -> ParameterTable:
    """Read the parameters of a caller's hand from a file, and check them.

    Parameters
    ----------
    path : Path
        TOML in the form of ``hand.toml``, with only those entries that differ. A bare number is in
        the unit that ``hand.toml`` has for the entry, and has the source ``assumed``.

    Returns
    -------
    ParameterTable
        The file's entries alone; `own_hand` completes them to a hand.

    Raises
    ------
    InvalidInputError
        If the file cannot be read or an entry is not possible; the message is one line that names
        file, entry and value.
    """
    own = ParameterTable.load(path, hand_table().units)
    with in_file(str(path)):
        own_hand(own)
    return own


def own_hand(own: ParameterTable, base: ParameterTable | None = None) -> ParameterTable:
    """Complete some parameters of a caller's hand to the table of a whole hand, and check them.

    Parameters
    ----------
    own : ParameterTable
        Entries of the caller's hand.
    base : ParameterTable, optional
        Table from which all other entries are taken; the bundled hand by default.

    Returns
    -------
    ParameterTable
        All entries of the hand.

    Raises
    ------
    InvalidInputError
        If an entry of ``own`` is unknown, or its unit, shape, sign or size is not possible, or the
        hand's tiles are wider than its frames; the field is its section and name.
    """
    bundled = hand_table()
    whole = (base or bundled).replaced(_checked(own, bundled.sections))
    check_widths(whole)
    return whole


def check_widths(table: ParameterTable) -> None:
    """Refuse a hand whose tiles are wider than the frames of its phalanges.

    Parameters
    ----------
    table : ParameterTable
        All entries of the hand.

    Raises
    ------
    InvalidInputError
        If ``finger.tile_width`` is not from 0 to ``finger.frame_width``.
    """
    tile, frame = (table.scalar("finger", name) for name in ("tile_width", "frame_width"))
    if not 0.0 <= tile <= frame:
        raise InvalidInputError(
            f"must be from 0 to finger.frame_width, {frame:g} m, got {tile:g} m; lower it, or "
            "raise frame_width",
            field="finger.tile_width",
        )


def own_surfaces(own: ParameterTable) -> ParameterTable:
    """Complete some parameters of a caller's surfaces to the table of all surfaces, and check them.

    Parameters
    ----------
    own : ParameterTable
        Entries of a preset, or of ``defaults``, which apply to every preset that lacks the entry.

    Returns
    -------
    ParameterTable
        All entries of the bundled surfaces, with those of ``own`` in their place.

    Raises
    ------
    InvalidInputError
        If an entry of ``own`` is unknown, or its unit, shape, sign or size is not possible; the
        field is its section and name.
    """
    bundled = surface_table()
    shared = bundled.sections["defaults"]
    presets = {name: each for name, each in bundled.sections.items() if name != "bounds"}
    known = {name: {**shared, **each} for name, each in presets.items()}
    return bundled.replaced(_checked(own, known))


def _checked(own: ParameterTable, known: Mapping[str, Mapping[str, Quantity]]) -> ParameterTable:
    """Return entries that are known, and can stand in the place of the known ones."""
    found: dict[str, dict[str, Quantity]] = {}
    for section, entries in own.sections.items():
        if section not in known:
            raise InvalidInputError(f"unknown section; {_known(section, known)}", field=section)
        for name, quantity in entries.items():
            field = f"{section}.{name}"
            if name not in known[section]:
                like = _known(name, known[section])
                raise InvalidInputError(f"unknown entry; {like}", field=field)
            usual = known[section][name]
            each = found.setdefault(section, {})[name] = _of_all(quantity, usual, field)
            _check(each, usual, field)
    return ParameterTable(found)


def _known(given: str, known: Iterable[str]) -> str:
    """List the known names, those first that are like the given one."""
    names = list(known)
    like = difflib.get_close_matches(given, names)
    return f"known are {', '.join([*like, *(name for name in names if name not in like)])}"


def _of_all(own: Quantity, bundled: Quantity, field: str) -> Quantity:
    """Return a list of one number for all, where that is meant by it."""
    if field != "tile.contact_stiffness" or isinstance(own.value, list):
        return own
    assert isinstance(bundled.value, list)
    return structs.replace(own, value=[own.value] * len(bundled.value))


def _check(own: Quantity, bundled: Quantity, field: str) -> None:
    """Refuse a number that cannot stand in the place of a bundled one."""
    got, usual = np.asarray(own.value, dtype=float), np.asarray(bundled.value, dtype=float)
    if got.shape != usual.shape:
        needed = f"a list of {usual.size} numbers" if usual.ndim else "one number"
        shown = own.value if got.size <= usual.size else f"a list of {got.size}"
        raise InvalidInputError(f"{needed} is needed, got {shown}", field=field)
    if own.unit != bundled.unit:
        unit = shorten(own.unit, LONGEST_QUOTE, placeholder=" …")
        raise InvalidInputError(
            f"must be in {bundled.unit!r}, got {own.value} in {unit!r}", field=field
        )
    # no bundled length is zero, but a coordinate may be, and then has either sign
    coordinate = own.unit == "m" and usual.min() == 0.0
    # others than lengths and angles up to so many times the bundled one: then digits are lost
    beyond = 1e4 * max(float(np.abs(usual).max()), 1.0)
    largest = LARGEST_BY_UNIT.get(own.unit, beyond)
    least = 0.0 if usual.min() >= 0.0 and not coordinate else -largest
    if not (least <= got.min() and got.max() <= largest):
        unit = "" if own.unit == "1" else f" {own.unit}"
        # a hand divides by the ratio, or is nowhere on rock with the exponent, and refuses zero
        positive = field in ("tile.rock_stiffness_ratio", "tile.engagement_exponent")
        start = "above 0 and at most" if positive else f"from {least:.4g} to"
        raise InvalidInputError(
            f"must be {start} {largest:.4g}{unit}, got {own.value}", field=field
        )
