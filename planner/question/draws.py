"""Monte Carlo samples of a stance's uncertain parameters, as hand models in a cache."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, errors_under, stored
from hand_models.hand import HandModel, SettledHand
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
    """Hand model, surface parameters and discrepancies of one sample.

    Attributes
    ----------
    model : HandModel
        Hand with the sample's parameter values.
    surfaces : ParameterTable
        The sample's parameters of all surfaces.
    half_planes : int or None
        Pieces of the law of tiles on presets; None for as many as the stance has.
    factors : mapping of str to float
        Factors on strengths: ``common`` on that of every hand, and by limb on that of its hand.
    """

    model: HandModel
    surfaces: ParameterTable
    half_planes: int | None = None
    factors: Mapping[str, float] = MappingProxyType({})

    def surface(self, usual: Surface) -> Surface:
        """Return a stance's surface with this sample's parameter values.

        Parameters
        ----------
        usual : Surface
            Surface in the stance. If it is one of the presets, its values are replaced by the
            sample's, and its number of half-planes stays if the sample has none. A surface with the
            caller's values is returned unchanged.
        """
        if usual.name is None:
            return usual
        planes = usual.half_planes
        if replace(Surface.named(usual.name), half_planes=planes) != usual:
            return usual
        found = Surface.named(usual.name, self.surfaces)
        return replace(found, half_planes=self.half_planes or planes)

    def closed(self, hand: SettledHand, limb: str) -> SettledHand:
        """Return a limb's hand, closed as it is, its tiles as strong as by the discrepancy."""
        factor = self.factors.get("common", 1.0) * self.factors.get(limb, 1.0)
        if factor == 1.0:
            return hand
        palm = hand.palm._replace(shear_limit=factor * hand.palm.shear_limit)
        return replace(hand, surface=hand.surface.times(factor), palm=palm)


@stored("hands of draws", 8)  # those used last
def drawn_hands(
    hand: HandModel,
    draws: tuple[ParameterSample, ...] | None = None,
    *,
    wrists_move: bool = False,
    limbs: tuple[str, ...] = (),
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
    limbs : tuple of str, optional
        Limbs with hands. Bundled samples have a factor on the strength of each one's hand.

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
        common, own = draw.discrepancy[:1], draw.discrepancy[1:]
        factors = dict(zip(("common",), common, strict=False))
        if own:
            factors |= {limb: own[k % len(own)] for k, limb in enumerate(sorted(limbs))}
        found.append(DrawnHand(model, surfaces, draw.half_planes, factors))
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
        Values in SI units. A name is ``section.entry``, with ``[i]`` for each number of a list;
        ``tile.half_planes`` and ``discrepancy.common`` or that of a limb are no entries.
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
    other: dict[str, list[float]] = {}
    if named and drawn:
        other["tile.half_planes"] = [each.half_planes or 0.0 for each in drawn]
    for name in drawn[0].factors if drawn else ():
        other[f"discrepancy.{name}"] = [each.factors[name] for each in drawn]
    varied = {name: np.array(each) for name, each in other.items()}
    return found | {name: each for name, each in varied.items() if np.ptp(each) > 0.0}


def _value(table: ParameterTable, section: str, name: str) -> float | list[float]:
    """Return an entry; of a preset that has none of its own, that of all surfaces."""
    own = name in table.sections.get(section, {})
    return table.quantity(section if own else "defaults", name).value
