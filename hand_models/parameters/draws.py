"""Samples: sets of the hand's and the surfaces' parameters that all meet the published data.

The published data leave parameters uncertain; ``draws.toml`` has, of each quantity that was fitted,
a list over the sets, and the ranges of quantities that no fit can find. One set makes one Monte
Carlo sample. Of everything that has a range (the strength of a tile on each surface but the fitted
sandpaper, and the seat) the samples have evenly spaced quantiles, u = (r + ½) / n with
r = 0 … n − 1 the rank of the sample's term in an additive recurrence of low discrepancy,

    x_kj = k φ⁻ʲ mod 1,    φ^(d+1) = φ + 1,    k = 1 … n samples,  j = 1 … d ranges,

so that the same sets make the same samples everywhere. Samples for wrists that move also have a
contact stiffness on rock, log-uniform by a recurrence of its own, so that all else in them is as
without it. A caller's samples are entries in the form of ``hand.toml`` and ``surfaces.toml``
(`own_draw`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from msgspec import structs

from hand_models.base import Array, InvalidInputError, errors_under, stored
from hand_models.parameters.own import own_hand, own_surfaces
from hand_models.parameters.tables import (
    ParameterTable,
    Quantity,
    draw_table,
    hand_table,
    surface_table,
)

__all__ = [
    "FITTED_SURFACE",
    "ParameterSample",
    "bundled_draws",
    "draws_of",
    "even_quantiles",
    "own_draw",
]

FITTED_SURFACE: Final = "sandpaper-36"
"""The surface on which a set's tile was fitted; the set has the strength on this surface."""

STIFFNESS_RATIO: Final = "rock_stiffness_ratio"
"""Entry of a tile: contact stiffness on rock over that of the fitted surface."""

ENTRY_PATH: Final = re.compile(r"(\w+)(?:\[(\d+)\])?")
"""Pattern of an entry's name, or of one number of an entry that is a list, such as ``radii[1]``."""


class ParameterSample(NamedTuple):
    """One Monte Carlo sample of uncertain parameters: changed entries of hand and surfaces.

    Attributes
    ----------
    hand : ParameterTable
        Changed entries of the hand, in the form of ``hand.toml``.
    surfaces : ParameterTable
        Changed entries of preset surfaces, in the form of ``surfaces.toml``. A caller's surface is
        known, so no sample changes it.
    """

    hand: ParameterTable
    surfaces: ParameterTable


def own_draw(raw: Mapping[str, Any]) -> ParameterSample:
    """Convert a caller's sample from JSON, and check its entries.

    Parameters
    ----------
    raw : mapping
        ``hand`` and ``surfaces``, each ``{section: {entry: {value, unit, source}}}``; either may be
        missing, not both.

    Raises
    ------
    InvalidInputError
        If a key or an entry is unknown, a value is not possible, or no entry is given; the field is
        the entry's path.
    """
    unknown = sorted(set(raw) - set(ParameterSample._fields))
    if unknown:
        valid = " and ".join(ParameterSample._fields)
        raise InvalidInputError(f"unknown; a sample has {valid}", field=unknown[0])
    tables = {}
    for name in ParameterSample._fields:
        entries = {} if raw.get(name) is None else raw[name]
        if not isinstance(entries, Mapping):
            raise InvalidInputError(
                f"sections of entries are needed, got {type(entries).__name__}", field=name
            )
        with errors_under(name):
            tables[name] = ParameterTable.of(entries)
    draw = ParameterSample(**tables)
    _check(draw, None)
    if not (list(draw.hand) or list(draw.surfaces)):
        raise InvalidInputError(
            "a sample must have at least one entry of hand or surfaces, got none: add one, "
            "or remove the sample"
        )
    return draw


def _check(draw: ParameterSample, hand: ParameterTable | None) -> None:
    """Refuse a draw with entries that are unknown, or of numbers that they cannot have."""
    with errors_under("hand"):
        own_hand(draw.hand, hand)
    with errors_under("surfaces"):
        own_surfaces(draw.surfaces)


@stored("draws", 8)
def bundled_draws(
    hand: ParameterTable | None = None, *, wrists_move: bool = False
) -> tuple[ParameterSample, ...]:
    """Return the bundled samples, one for each set of ``draws.toml``; a cache keeps 8 results.

    Parameters
    ----------
    hand : ParameterTable, optional
        All parameters of the hand; the bundled ones by default. Entries that differ from the
        bundled hand are taken as known: no sample changes them.
    wrists_move : bool, optional
        Whether the samples are for compliant or floating wrists; see `draws_of`.
    """
    return draws_of(draw_table(), hand, wrists_move=wrists_move)


def draws_of(
    sets: ParameterTable, hand: ParameterTable | None = None, *, wrists_move: bool = False
) -> tuple[ParameterSample, ...]:
    """Make the samples of a table of fitted sets and ranges.

    Parameters
    ----------
    sets : ParameterTable
        Fitted sets and ranges, in the form of ``draws.toml``.
    hand : ParameterTable, optional
        All parameters of the hand; the bundled ones by default. Entries that differ from the
        bundled hand are taken as known: no sample changes them.
    wrists_move : bool, optional
        Whether the samples are for compliant or floating wrists, and so have a contact stiffness on
        rock; everything else in them is the same. A caller's ``contact_stiffness`` is taken as that
        on rock.

    Returns
    -------
    tuple of ParameterSample
        One for each set.

    Raises
    ------
    InvalidInputError
        If an entry is unknown or missing, in another unit, of another length than the others, or
        has a value that is not possible.
    """
    hand = hand or hand_table()
    count = _checked_count(sets)
    known = hand.difference(hand_table())
    quantiles = even_quantiles(count, len(_ranged()) + 1)
    ratios = _stiffness_ratios(sets, known, count) if wrists_move else None
    draws = []
    for k in range(count):
        strengths = _strengths(sets, k, quantiles[k, :-1])
        of_hand = _hand_of(sets, k, hand, known, float(quantiles[k, -1]))
        if ratios is not None:
            of_hand = of_hand.replaced(ParameterTable({"tile": {STIFFNESS_RATIO: ratios[k]}}))
        draw = ParameterSample(of_hand, strengths)
        with errors_under(f"[{k}]"):
            _check(draw, hand)
        draws.append(draw)
    return tuple(draws)


def even_quantiles(count: int, ranges: int) -> Array:
    """Return evenly spaced quantiles for Monte Carlo samples of several ranges.

    Each range has every (r + ½) / count once; the module's text says in which order.

    Parameters
    ----------
    count, ranges : int
        Numbers of samples and of ranges.

    Returns
    -------
    ndarray, shape (count, ranges)
        Quantiles in (0, 1): a row for each sample, a column for each range.
    """
    ratio = 1.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (ranges + 1))
    terms = np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, ranges + 1)) % 1.0
    ranks = terms.argsort(axis=0).argsort(axis=0)
    return np.asarray((ranks + 0.5) / count)


def _ranged() -> list[str]:
    """Return the surfaces whose strength is drawn from a range."""
    presets = surface_table().sections
    return [name for name in presets if name not in ("bounds", "defaults", FITTED_SURFACE)]


def _fitted(sets: ParameterTable) -> Iterator[tuple[str, str, Quantity]]:
    """Yield what was fitted: section, entry, and the list over the sets."""
    return (each for each in sets if each[0] not in ("fit", "ranges"))


def _checked_count(sets: ParameterTable) -> int:
    """Return how many sets there are."""
    # of each set how far it is from the data, and where it lies
    counts = {f"fit.{name}": len(sets.vector("fit", name)) for name in ("misfit", "valley")}
    sets.vector(FITTED_SURFACE, "shear_limit")
    for section, name, quantity in _fitted(sets):
        _check_entry(section, name, quantity)
        counts[f"{section}.{name}"] = len(sets.vector(section, name))
    count = counts["fit.misfit"]
    for field, other in counts.items():
        if other != count:
            raise InvalidInputError(
                f"must have a number for each of the {count} sets, got {other}", field=field
            )
    least = 30  # fewer leave a 5 % quantile too uncertain
    if count < least:
        raise InvalidInputError(f"at least {least} sets are needed, got {count}", field="fit")
    for k, misfit in enumerate(sets.vector("fit", "misfit")):
        if not 0.0 <= misfit <= 1.0:
            raise InvalidInputError(
                f"must be from 0 to 1 (1: off the data by their whole tolerance), got {misfit:g}",
                field=f"fit.misfit.value[{k}]",
            )
    for name in ("rock_ratio", "rock_stiffness"):
        if (size := len(sets.vector("ranges", name))) != 2:
            raise InvalidInputError(
                f"two numbers are needed, the least and the largest, got {size}",
                field=f"ranges.{name}",
            )
    return count


def _check_entry(section: str, name: str, quantity: Quantity) -> None:
    """Refuse a list over the sets of what is no number of a hand, or of a fitted tile."""
    field, hand, surfaces = f"{section}.{name}", hand_table().sections, surface_table().sections
    of_tile = {**surfaces["defaults"], **surfaces[FITTED_SURFACE]}
    entries = of_tile if section in ("defaults", FITTED_SURFACE) else hand.get(section, {})
    found = ENTRY_PATH.fullmatch(name)
    entry, index = (name, None) if found is None else (found[1], found[2])
    if entry not in entries:
        where, known = f"entry; known in [{section}]", list(entries)
        if not known:
            where, known = "section; known", ["defaults", FITTED_SURFACE, *hand]
        raise InvalidInputError(f"unknown {where} are {', '.join(known)}", field=field)
    usual = entries[entry]
    size = len(usual.value) if isinstance(usual.value, list) else 0
    if (index is None) != (size == 0) or int(index or 0) > max(size - 1, 0):
        form = f"one of {entry}[0] to {entry}[{size - 1}]" if size else entry
        has = f"a list of {size} numbers" if size else "one number"
        raise InvalidInputError(
            f"the entry's name must be {form}, as the hand has {has} there; got {name}", field=field
        )
    if quantity.unit != usual.unit:
        raise InvalidInputError(f"must be in {usual.unit!r}, got {quantity.unit!r}", field=field)


def _hand_of(
    sets: ParameterTable, k: int, hand: ParameterTable, known: ParameterTable, quantile: float
) -> ParameterTable:
    """Return what a draw changes of a hand, but for entries that are known."""
    found: dict[str, dict[str, Quantity]] = {}

    def change(section: str, name: str, value: float, quantity: Quantity, place: int) -> None:
        if name in known.sections.get(section, {}):
            return
        entries = found.setdefault(section, {})
        now = entries.get(name, hand.quantity(section, name))
        entries[name] = structs.replace(quantity, value=now.changed(value, place).value)

    for section, name, quantity in _fitted(sets):
        if section in hand_table().sections:
            path = ENTRY_PATH.fullmatch(name)
            assert path is not None  # of a checked table
            value = sets.vector(section, name)[k]
            change(section, path[1], value, quantity, int(path[2] or 0))
            drawn = path[1] in found.get(section, {})
            if (section, name) == ("tile", "engagement[0]") and drawn:
                # a base tile engages as a proximal one
                change(section, "base_engagement", value, quantity, 0)
    aside = sets.quantity("ranges", "seated_contact")
    middle, half = hand.scalar("finger", "seated_contact"), sets.scalar("ranges", "seated_contact")
    change("finger", "seated_contact", middle + half * (2.0 * quantile - 1.0), aside, 0)
    return ParameterTable(found)


def _stiffness_ratios(
    sets: ParameterTable, known: ParameterTable, count: int
) -> list[Quantity] | None:
    """Return each sample's contact stiffness on rock over that of the fit; None where known."""
    if {STIFFNESS_RATIO, "contact_stiffness"} & known.sections.get("tile", {}).keys():
        return None
    least, most = sets.vector("ranges", "rock_stiffness")
    # the first range of a longer recurrence than that of all other ranges
    own = even_quantiles(count, len(_ranged()) + 3)[:, 0]
    entry = sets.quantity("ranges", "rock_stiffness")
    values: list[float] = (least * (most / least) ** own).tolist()
    return [structs.replace(entry, value=value) for value in values]


def _strengths(sets: ParameterTable, k: int, quantiles: Array) -> ParameterTable:
    """Return what a draw changes of the surfaces.

    Rock is evenly distributed between its least and largest ratio to the set's own tile. Others
    are normal about their ``shear_limit``, with the standard deviation ``scatter_ratio`` of it, but
    for the tail below ``ranges.least_strength`` of it.
    """
    table = surface_table()
    found: dict[str, dict[str, Quantity]] = {}
    for section, name, quantity in _fitted(sets):
        if section in table.sections:
            value = sets.vector(section, name)[k]
            found.setdefault(section, {})[name] = structs.replace(quantity, value=value)
    tile = sets.vector(FITTED_SURFACE, "shear_limit")[k]
    least, most = sets.vector("ranges", "rock_ratio")
    floor = sets.scalar("ranges", "least_strength")
    for name, u in zip(_ranged(), quantiles.tolist(), strict=True):
        usual = table.quantity(name, "shear_limit")
        if name == "rock":  # so many times as strong as the fitted one
            strength, source = tile * (least + (most - least) * u), "ranges.rock_ratio"
        else:
            scatter = table.scalar(name, "scatter_ratio")
            cut = scipy.special.ndtr((floor - 1.0) / scatter)
            strength = table.scalar(name, "shear_limit") * (
                1.0 + scatter * float(scipy.special.ndtri(cut + (1.0 - cut) * u))
            )
            source = "scatter_ratio"
        found.setdefault(name, {})["shear_limit"] = structs.replace(
            usual, value=float(strength), note=f"drawn by {source}"
        )
    return ParameterTable(found)
