"""Monte Carlo samples of a stance's uncertain parameters, as hand models in a cache."""

from __future__ import annotations

from collections.abc import Sequence
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
    """Hand model and surface parameters of one sample.

    Attributes
    ----------
    model : HandModel
        Hand with the sample's parameter values.
    surfaces : ParameterTable
        The sample's parameters of all surfaces.
    """

    model: HandModel
    surfaces: ParameterTable

    def surface(self, usual: Surface) -> Surface:
        """Return a stance's surface with this sample's parameter values.

        Parameters
        ----------
        usual : Surface
            Surface in the stance. If it is one of the presets, its values are replaced by the
            sample's, and its number of half-planes stays. A surface with the caller's values is
            returned unchanged.
        """
        if usual.name is None:
            return usual
        planes = usual.half_planes
        if replace(Surface.named(usual.name), half_planes=planes) != usual:
            return usual
        return replace(Surface.named(usual.name, self.surfaces), half_planes=planes)


@stored("hands of draws", 8)  # those used last
def drawn_hands(
    hand: HandModel,
    draws: tuple[ParameterSample, ...] | None = None,
    *,
    wrists_move: bool = False,
) -> tuple[DrawnHand, ...]:
    """Return the hand model and the surfaces of each Monte Carlo sample. Cached.

    Parameters
    ----------
    hand : HandModel
        Hand of the stance. Parameters that a sample does not contain have the values of this hand.
    draws : tuple of ParameterSample, optional
        Samples; the bundled ones by default.
    wrists_move : bool, optional
        Whether the bundled samples are for compliant or floating wrists, and so have a contact
        stiffness on rock.

    Returns
    -------
    tuple of DrawnHand
        One for each sample.

    Raises
    ------
    InvalidInputError
        If a sample's values make no possible hand or surface; the field begins with its index.
    """
    if draws is None:
        draws = bundled_draws(hand.table, wrists_move=wrists_move)
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
    drawn: Sequence[DrawnHand], surfaces: frozenset[str | None]
) -> dict[str, Array]:
    """Return the values of each uncertain parameter over all samples, by name.

    Parameters
    ----------
    drawn : sequence of DrawnHand
        Hand model and surfaces of each sample.
    surfaces : frozenset of str or None
        Names of the surfaces that the hands are on. Parameters of other surfaces are left out, and
        so are parameters with the same value in all samples.

    Returns
    -------
    dict of str to ndarray, shape (draws,)
        Values in SI units. A name is ``section.entry``, with ``[i]`` for each number of a list.
    """
    named = {name for name in surfaces if name is not None}
    on_presets = named | {"defaults"} if named else named
    presets = surface_table().sections
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
