"""Draws of numbers as hands: what each makes of a stance's hand and of its surfaces."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, errors_under, stored
from hand_models.hand import HandModel
from hand_models.parameters import (
    ParameterSample,
    ParameterTable,
    bundled_draws,
    own_hand,
    own_surfaces,
    surface_table,
)
from hand_models.tile import Surface, surface_names

__all__ = ["DrawnHand", "drawn_hands", "drawn_quantities"]


class DrawnHand(NamedTuple):
    """A hand, and what a tile holds, with the numbers of one draw.

    Attributes
    ----------
    model : HandModel
    surfaces : ParameterTable
        All numbers of the surfaces.
    """

    model: HandModel
    surfaces: ParameterTable

    def surface(self, usual: Surface) -> Surface:
        """Return what a tile holds in this draw where it usually holds what a surface says.

        A caller's own numbers stay; of a preset, so does how many half-planes stand for it.
        """
        if usual.name is None:
            return usual
        planes = usual.half_planes
        if replace(Surface.named(usual.name), half_planes=planes) != usual:
            return usual
        return replace(Surface.named(usual.name, self.surfaces), half_planes=planes)


@stored("hands of draws", 8)  # those used last
def drawn_hands(
    hand: HandModel, draws: tuple[ParameterSample, ...] | None = None
) -> tuple[DrawnHand, ...]:
    """Return what draws make of a hand.

    Parameters
    ----------
    hand : HandModel
        Of the stance: what a draw leaves open is as with this one.
    draws : tuple of ParameterSample, optional
        The bundled ones by default.

    Raises
    ------
    InvalidInputError
        If a draw makes no possible hand, or surface; the field begins with its number.
    """
    if draws is None:
        draws = bundled_draws(hand.table)
    found = []
    for i, draw in enumerate(draws):
        with errors_under(f"[{i}]"):
            with errors_under("hand"):
                model = HandModel(own_hand(draw.hand, hand.table))
            with errors_under("surfaces"):
                surfaces = own_surfaces(draw.surfaces)
                for name in surface_names():
                    with errors_under(name):
                        Surface.named(name, surfaces)
        found.append(DrawnHand(model, surfaces))
    return tuple(found)


def drawn_quantities(
    hand: HandModel, draws: tuple[ParameterSample, ...] | None, surfaces: frozenset[str | None]
) -> dict[str, Array]:
    """Return the numbers in which draws differ, shape (draws,) each, by their names.

    Parameters
    ----------
    hand, draws
        As of `drawn_hands`.
    surfaces : frozenset of str or None
        Names of the surfaces that hands are on; numbers of others are left out.

    Returns
    -------
    dict of str to ndarray
        In SI units, by ``section.entry``, with ``[i]`` for each number of a list.
    """
    named = {name for name in surfaces if name is not None}
    on_presets = named | {"defaults"} if named else named
    drawn, presets = drawn_hands(hand, draws), surface_table().sections
    found = {}
    for tables in ([each.model.table for each in drawn], [each.surfaces for each in drawn]):
        entries = dict.fromkeys((section, name) for table in tables for section, name, _ in table)
        for section, name in entries:
            if section in presets and section not in on_presets:
                continue
            over = np.array([_value(table, section, name) for table in tables])
            for i, values in enumerate(over.reshape(len(tables), -1).T):
                if np.ptp(values) > 0.0:
                    entry = name if over.ndim == 1 else f"{name}[{i}]"
                    found[f"{section}.{entry}"] = values
    return found


def _value(table: ParameterTable, section: str, name: str) -> float | list[float]:
    """Return an entry; of a preset that has none of its own, that of all surfaces."""
    own = name in table.sections.get(section, {})
    return table.quantity(section if own else "defaults", name).value
