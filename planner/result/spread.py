"""The spread of an answer: plan and load factor over draws of what nobody knows exactly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from msgspec import Struct

if TYPE_CHECKING:
    from hand_models.base import Array

__all__ = ["SPREAD_SETTINGS", "DrawnPlan", "Influence", "Quantiles", "Spread", "SpreadSettings"]


@dataclass(frozen=True, slots=True)
class SpreadSettings:
    """Numbers of samples from which statistics are given."""

    many_draws: int = 20  # of which 5 % are one; of fewer the extremes are reported
    least_variation: float = 1e-4  # of numbers, over the largest: less is the solver's error


SPREAD_SETTINGS: Final = SpreadSettings()


class DrawnPlan(Struct, frozen=True):
    """The verified plan of a draw; None where there is no such plan, or number.

    Attributes
    ----------
    utilisation, load_factor : float or None
    holds : bool
        Whether it would be ``optimal``.
    """

    utilisation: float | None = None
    load_factor: float | None = None
    holds: bool = False


class Quantiles(Struct, frozen=True):
    """A number over draws: its 5, 50 and 95 % quantiles (linear between draws).

    Of fewer than 20 draws: the least, the median and the largest.
    """

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float | None]) -> Quantiles | None:
        """Return the quantiles of the numbers that are there; None if none is."""
        import numpy as np

        there = [value for value in values if value is not None]
        percents = (
            (5.0, 50.0, 95.0) if len(there) >= SPREAD_SETTINGS.many_draws else (0.0, 50.0, 100.0)
        )
        return cls(*np.percentile(there, percents).tolist()) if there else None


class Influence(Struct, frozen=True):
    """The share of the load factor's variation over the draws that goes with one drawn quantity.

    Attributes
    ----------
    quantity : str
        As in parameter files: ``rock.shear_limit``, ``finger.pulley_radii[1]``.
    share : float
        ρ² in [0, 1]; see `Spread`.
    """

    quantity: str
    share: float


class Spread(Struct, frozen=True):
    """A plan and its load factor over draws of the hand's and the rock's numbers.

    Body wrench, poses, joints and all that was asked stay; every draw has a plan of its own, which
    is verified as any plan is. A draw has no plan where a hand cannot be in its place, nothing
    balances the body, or none passes the checks; it counts as not holding.

    Attributes
    ----------
    draws, holds, without : int
        Draws; those in which the stance holds within the cap on the utilisation; and those that
        have no plan, of which some may have a load factor.
    cap : float
        That cap.
    refused : dict of str to int
        In how many draws a hand cannot be, by limb; those that always can are left out.
    utilisation : Quantiles or None
        Over the draws that have one.
    load_factor : Quantiles or None
        Over all draws; one without a plan counts as 0. None where no draw has one.
    hangs_on : list of Influence
        Deprecated: the same as ``sensitive_to``.
    utilisations, load_factors : list of float or None
        Of each draw, in order.
    sensitive_to : list of Influence
        The drawn quantities with which most of the load factor's variation goes, the first three,
        the largest share first. A share is the squared rank correlation

            ρ² = (Σ_k a_k b_k)² / (Σ_k a_k² Σ_k b_k²)

        of the quantity's ranks a and the load factor's ranks b among the draws that have one, less
        their means; equal numbers have their mean rank. Quantities that vary together in the draws
        share what they explain, so that shares do not add up to 1. Empty where the load factor does
        not vary by more than 1e-4 of itself, or fewer than three draws have one.
    """

    draws: int
    holds: int
    without: int
    cap: float
    refused: dict[str, int]
    utilisation: Quantiles | None
    load_factor: Quantiles | None
    hangs_on: list[Influence]
    utilisations: list[float | None]
    load_factors: list[float | None]
    sensitive_to: list[Influence] = []

    @classmethod
    def of(
        cls,
        plans: Sequence[DrawnPlan],
        cap: float,
        refused: Mapping[str, int],
        drawn: Mapping[str, Array],
    ) -> Spread:
        """Return what plans of all draws say.

        Parameters
        ----------
        plans : sequence of DrawnPlan, length n
        cap : float
            On the utilisation.
        refused : mapping of str to int
        drawn : mapping of str to ndarray, shape (n,)
            The quantities by name, and what each is in every draw.
        """
        used, factors = [p.utilisation for p in plans], [p.load_factor for p in plans]
        some = any(factor is not None for factor in factors)
        influences = _influences(factors, drawn)
        carried = [
            0.0 if u is None and factor is None else factor
            for u, factor in zip(used, factors, strict=True)
        ]
        return cls(
            draws=len(plans),
            holds=sum(each.holds for each in plans),
            without=used.count(None),
            cap=cap,
            refused=dict(refused),
            utilisation=Quantiles.of(used),
            load_factor=Quantiles.of(carried) if some else None,
            hangs_on=influences,
            utilisations=used,
            load_factors=factors,
            sensitive_to=influences,
        )


def _influences(factors: Sequence[float | None], drawn: Mapping[str, Array]) -> list[Influence]:
    """Return the largest shares of the load factor's variation, the largest first."""
    import numpy as np

    there = [k for k, factor in enumerate(factors) if factor is not None]
    found = np.array([factors[k] for k in there], dtype=float)
    # of fewer than three a correlation says nothing
    if len(found) < 3 or np.ptp(found) <= SPREAD_SETTINGS.least_variation * np.abs(found).max():
        return []
    b = _centred_ranks(found, SPREAD_SETTINGS.least_variation * np.abs(found).max())
    shares: dict[bytes, Influence] = {}
    for name, values in drawn.items():
        a = _centred_ranks(values[there])
        if a.any():
            # a quantity that is ordered as one before says the same
            share = float((a @ b) ** 2 / ((a @ a) * (b @ b)))
            shares.setdefault(a.tobytes(), Influence(name, share))
    return sorted(shares.values(), key=lambda each: -each.share)[:3]  # the largest


def _centred_ranks(values: Array, least: float = 0.0) -> Array:
    """Return ranks less their mean, shape (n,).

    Values that differ by no more than ``least`` from the next have their mean rank.
    """
    import numpy as np

    order = values.argsort()
    steps = np.diff(values[order]) > least
    places = np.empty(len(values), dtype=np.intp)
    places[order] = np.append(0, np.cumsum(steps))
    counts = np.bincount(places)
    ranks = (np.cumsum(counts) - 0.5 * (counts - 1.0))[places]
    return np.asarray(ranks - ranks.mean())
