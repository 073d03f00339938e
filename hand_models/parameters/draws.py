"""Samples: sets of the hand's and the surfaces' parameters that all meet the published data.

The published data leave parameters uncertain; ``draws.toml`` has, of each quantity that was fitted,
a list over the sets, and the ranges of quantities that no fit can find. One set makes one Monte
Carlo sample. Of everything that has a range (the strength of a tile on each surface but the fitted
sandpaper, the seat, the law of engagement, the palm's stiffness, the law of a tile) the samples
have evenly spaced quantiles (`even_quantiles`), so that the same sets make the same samples
everywhere. Samples for wrists that move also have a contact stiffness on rock; all else in them is
as without it. A caller's samples are entries in the form of ``hand.toml`` and ``surfaces.toml``
(`own_draw`).

What the model itself is wrong by is a factor on the strength of each limb's hand, log-normal,

    exp(δ (√ρ z + √(1 − ρ) z_i)),

with δ the discrepancy, z a normal number that all hands have in common, z_i each limb's own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from msgspec import structs

from hand_models.base import Array, InvalidInputError, errors_under, stored
from hand_models.parameters.own import own_hand, own_surfaces
from hand_models.parameters.quantiles import even_quantiles
from hand_models.parameters.tables import (
    ParameterTable,
    Quantity,
    draw_table,
    hand_table,
    surface_table,
)

__all__ = [
    "FITTED_SURFACE",
    "OF_GRIPPER",
    "ParameterSample",
    "bundled_draws",
    "draws_of",
    "own_draw",
]

FITTED_SURFACE: Final = "sandpaper-36"
"""The surface on which a set's tile was fitted; the set has the strength on this surface."""

ENTRY_PATH: Final = re.compile(r"(\w+)(?:\[(\d+)\])?")
"""Pattern of an entry's name, or of one number of an entry that is a list, such as ``radii[1]``."""


OF_GRIPPER: Final = {
    "base_half_spacing": "gripper",
    "added_radius": "gripper",
    "origin_height": "gripper",
    "tile_height": "finger",
    "seated_contact": "finger",
}
"""Entries that each set has of the paper's gripper alone, and their sections in its table."""


class ParameterSample(NamedTuple):
    """One Monte Carlo sample of uncertain parameters: changed entries of hand and surfaces.

    Attributes
    ----------
    hand : ParameterTable
        Changed entries of the hand, in the form of ``hand.toml``.
    surfaces : ParameterTable
        Changed entries of preset surfaces, in the form of ``surfaces.toml``. A caller's surface is
        known, so no sample changes it.
    half_planes : int or None
        Pieces of the law of tiles on preset surfaces; as the stance has them by default.
    discrepancy : tuple of float
        Factors on the strengths of hands: that of all, then that of each limb, in the order of the
        limbs' names. Empty if the sample has none.
    gripper : ParameterTable or None
        Entries of the paper's gripper that are not the hand's, in its sections.
    """

    hand: ParameterTable
    surfaces: ParameterTable
    half_planes: int | None = None
    discrepancy: tuple[float, ...] = ()
    gripper: ParameterTable | None = None


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
    fields = "hand", "surfaces"
    unknown = sorted(set(raw) - set(fields))
    if unknown:
        valid = " and ".join(fields)
        raise InvalidInputError(f"unknown; a sample has {valid}", field=unknown[0])
    tables = {}
    for name in fields:
        entries = {} if raw.get(name) is None else raw[name]
        if not isinstance(entries, Mapping):
            raise InvalidInputError(
                f"sections of entries are needed, got {type(entries).__name__}", field=name
            )
        with errors_under(name):
            tables[name] = ParameterTable.of(entries)
    draw = ParameterSample(tables["hand"], tables["surfaces"])
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
    surfaces = len(_ranged())
    # of seated_contact, engagement_exponent, palm_stiffness and half_planes
    first = surfaces + 4
    own_factors = 8  # limbs with a factor of their own; a body with more has some twice
    quantiles = even_quantiles(count, first + 2 + own_factors)
    ratios = _stiffness_ratios(sets, known, quantiles[:, first]) if wrists_move else None
    factors = _discrepancies(sets, quantiles[:, first + 1 :]).tolist()
    planes = sets.vector("ranges", "half_planes")
    draws = []
    for k in range(count):
        strengths = _strengths(sets, k, quantiles[k, :surfaces])
        *of_hand, of_law = quantiles[k, surfaces:first].tolist()
        own = _hand_of(sets, k, hand, known, of_hand)
        if ratios is not None:
            own = own.replaced(ParameterTable({"tile": {"rock_stiffness_ratio": ratios[k]}}))
        law = int(planes[int(of_law * len(planes))])
        draw = ParameterSample(own, strengths, law, tuple(factors[k]), _gripper_of(sets, k))
        with errors_under(f"[{k}]"):
            _check(draw, hand)
        draws.append(draw)
    return tuple(draws)


def _ranged() -> list[str]:
    """Return the surfaces whose strength is drawn from a range."""
    presets = surface_table().sections
    return [name for name in presets if name not in ("bounds", "defaults", FITTED_SURFACE)]


def _fitted(sets: ParameterTable) -> Iterator[tuple[str, str, Quantity]]:
    """Yield what was fitted: section, entry, and the list over the sets."""
    return (each for each in sets if each[0] not in ("fit", "gripper", "ranges"))


def _checked_count(sets: ParameterTable) -> int:
    """Return how many sets there are."""
    # of each set how far it is from the data
    counts = {"fit.misfit": len(sets.vector("fit", "misfit"))}
    counts |= {f"gripper.{name}": len(sets.vector("gripper", name)) for name in OF_GRIPPER}
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
    for name in ("rock_ratio", "rock_stiffness", "engagement_exponent", "palm_stiffness"):
        if (size := len(sets.vector("ranges", name))) != 2:
            raise InvalidInputError(
                f"two numbers are needed, the least and the largest, got {size}",
                field=f"ranges.{name}",
            )
    for name in ("discrepancy", "discrepancy_common"):
        if not 0.0 <= (value := sets.scalar("ranges", name)) <= 1.0:
            raise InvalidInputError(f"must be from 0 to 1, got {value:g}", field=f"ranges.{name}")
    for i, planes in enumerate(sets.vector("ranges", "half_planes")):
        if not (1 <= planes <= 64 and planes == int(planes)):
            raise InvalidInputError(
                f"must be a whole number from 1 to 64, got {planes:g}",
                field=f"ranges.half_planes.value[{i}]",
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
    sets: ParameterTable,
    k: int,
    hand: ParameterTable,
    known: ParameterTable,
    quantiles: Sequence[float],
) -> ParameterTable:
    """Return what a draw changes of a hand, but for entries that are known.

    ``quantiles``: of the seat, of the law of engagement and of the palm's stiffness.
    """
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
    seat, law, palm = quantiles
    change("finger", "seated_contact", middle + half * (2.0 * seat - 1.0), aside, 0)
    entry = sets.quantity("ranges", "engagement_exponent")
    exponent = _log_even(sets, "engagement_exponent", law)
    change("tile", "engagement_exponent", exponent, entry, 0)
    factor = _log_even(sets, "palm_stiffness", palm)
    unit = hand.quantity("palm", "contact_stiffness").unit
    entry = structs.replace(sets.quantity("ranges", "palm_stiffness"), unit=unit)
    for i, stiffness in enumerate(hand.vector("palm", "contact_stiffness")):
        change("palm", "contact_stiffness", factor * stiffness, entry, i)
    return ParameterTable(found)


def _gripper_of(sets: ParameterTable, k: int) -> ParameterTable:
    """Return the entries of the gripper alone."""
    found: dict[str, dict[str, Quantity]] = {}
    for name, section in OF_GRIPPER.items():
        value = sets.vector("gripper", name)[k]
        quantity = structs.replace(sets.quantity("gripper", name), value=value)
        found.setdefault(section, {})[name] = quantity
    return ParameterTable(found)


def _log_even(sets: ParameterTable, name: str, quantile: float) -> float:
    """Return a quantile of a range of which the logarithm is evenly distributed."""
    least, most = sets.vector("ranges", name)
    return float(least * (most / least) ** quantile)


def _discrepancies(sets: ParameterTable, quantiles: Array) -> Array:
    """Return the factors on strengths of all hands and of each limb's, shape (count, 1 + limbs)."""
    common = sets.scalar("ranges", "discrepancy_common")
    wide = np.full(quantiles.shape[1], np.sqrt(1.0 - common))
    wide[0] = np.sqrt(common)
    scores = scipy.special.ndtri(quantiles)
    return np.asarray(np.exp(sets.scalar("ranges", "discrepancy") * wide * scores))


def _stiffness_ratios(
    sets: ParameterTable, known: ParameterTable, quantiles: Array
) -> list[Quantity] | None:
    """Return each sample's contact stiffness on rock over that of the fit; None where known."""
    if {"rock_stiffness_ratio", "contact_stiffness"} & known.sections.get("tile", {}).keys():
        return None
    entry = sets.quantity("ranges", "rock_stiffness")
    values = [_log_even(sets, "rock_stiffness", u) for u in quantiles.tolist()]
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
