"""Spread of a plan: statistics of utilisation and load factor over Monte Carlo samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from msgspec import Struct

if TYPE_CHECKING:
    from hand_models.base import Array

__all__ = [
    "SPREAD_SETTINGS",
    "DrawnPlan",
    "Influence",
    "Quantiles",
    "SentPlan",
    "SentSpread",
    "Spread",
    "SpreadSettings",
    "StrengthThreshold",
]


@dataclass(frozen=True, slots=True)
class SpreadSettings:
    """Thresholds for statistics over Monte Carlo samples."""

    many_draws: int = 20  # of which 5 % are one; of fewer the extremes are reported
    least_variation: float = 1e-4  # of numbers, over the largest: less is the solver's error
    chance: float = 4.0
    """Over the number of samples, a squared correlation that one in twenty has by chance."""
    least_rest: float = 1e-12
    """Least product of squared sums of which a squared correlation is one: less is rounding."""


SPREAD_SETTINGS: Final = SpreadSettings()


class DrawnPlan(Struct, frozen=True):
    """Verified plan with the parameter values of one sample; None for a missing value.

    Attributes
    ----------
    utilisation, load_factor : float or None
        Least utilisation and load factor of the sample.
    holds : bool
        Whether the plan's status is ``optimal``: feasible at the cap on the utilisation.
    """

    utilisation: float | None = None
    load_factor: float | None = None
    holds: bool = False


class Quantiles(Struct, frozen=True):
    """Quantiles of a number over Monte Carlo samples: 5, 50 and 95 % (linear interpolation).

    With fewer than 20 samples ``low`` is the least, ``high`` the largest value.
    """

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Sequence[float | None]) -> Quantiles | None:
        """Return the quantiles of the values that are not None; None if all are None."""
        import numpy as np

        there = [value for value in values if value is not None]
        many = len(there) >= SPREAD_SETTINGS.many_draws
        percents = (5.0, 50.0, 95.0) if many else (0.0, 50.0, 100.0)
        return cls(*np.percentile(there, percents).tolist()) if there else None


class SentPlan(Struct, frozen=True):
    """Outcome of set-points of tensions in one sample, verified; None for a missing value.

    Attributes
    ----------
    utilisation : float or None
        Utilisation where the body is in balance; None without a balance.
    holds : bool
        Whether the body is in balance within the cap on the utilisation, with no tile dragged
        backwards.
    """

    utilisation: float | None = None
    holds: bool = False


class SentSpread(Struct, frozen=True):
    """Statistics over samples in which a plan's tensions are set-points.

    Attributes
    ----------
    holds, without : int
        Number of samples that hold, and of samples without a balance (those among them in which a
        hand cannot be closed).
    utilisation : Quantiles or None
        Over the samples with a balance; None if there are none.
    utilisations : list of float or None
        Value of each sample, in order.
    """

    holds: int
    without: int
    utilisation: Quantiles | None
    utilisations: list[float | None]

    @classmethod
    def of(cls, plans: Sequence[SentPlan] | None) -> SentSpread | None:
        """Compute the statistics over all samples; None where there are none."""
        if plans is None:
            return None
        used = [each.utilisation for each in plans]
        return cls(sum(x.holds for x in plans), used.count(None), Quantiles.of(used), used)


class Influence(Struct, frozen=True):
    """Sensitivity of the load factor to one uncertain parameter.

    Attributes
    ----------
    quantity : str
        Name of the parameter as in parameter files: ``rock.shear_limit``,
        ``finger.pulley_radii[1]``.
    share : float
        In [0, 1]: of ``sensitive_to`` the squared rank correlation ρ² with the load factor, of
        ``rock_apart`` the share of the variance; see `Spread`.
    source : str
        Source of the values: ``calibrated`` where they were fitted to published data; ``paper``,
        ``measured`` or ``assumed`` where nothing narrows them but what was known before (a prior).
    """

    quantity: str
    share: float
    source: str = ""


class StrengthThreshold(Struct, frozen=True):
    """Least strength of the rock with which a stance is feasible, all else as usual.

    Attributes
    ----------
    surface : str
        Name of the preset surface.
    shear_limit : float or None
        Least strength of a tile on it in shear [N], to about 1 %: the least of the assumed range
        where the stance is feasible on all of it; None where it is feasible on none of it.
    ratio : float or None
        The same over the strength on the sandpaper of the calibration.
    range : list of float, length 2
        Assumed least and largest ratio, evenly distributed.
    share : float
        Share of this range on which the stance is feasible.
    """

    surface: str
    shear_limit: float | None
    ratio: float | None
    range: list[float]
    share: float


class Spread(Struct, frozen=True):
    """Spread of utilisation and load factor over Monte Carlo samples of uncertain parameters.

    The parameters are those of the hand and the rock. Body wrench, poses, joints and all else in
    the question stay. Each sample (draw) has a plan, verified as any plan is. A sample has no plan
    if a hand cannot be closed, nothing balances the body, or no plan passes the checks; it then
    counts as not feasible.

    Attributes
    ----------
    draws, holds, without : int
        Number of samples; of samples with a plan within the cap on the utilisation; and of samples
        without a plan, some of which may have a load factor.
    cap : float
        Cap on the utilisation.
    refused : dict of str to int
        Number of samples in which a hand cannot be closed, by limb; limbs without such samples are
        left out.
    utilisation : Quantiles or None
        Over the samples with a plan.
    load_factor : Quantiles or None
        Over all samples; a sample without load factor counts as 0 if it has no plan, or its plan is
        overloaded. None if no sample has a load factor.
    hangs_on : list of Influence
        Deprecated: the same as ``sensitive_to``.
    utilisations, load_factors : list of float or None
        Value of each sample, in order.
    sensitive_to : list of Influence
        The three parameters to which the load factor is most sensitive, the largest share first. A
        share is the squared Spearman rank correlation

            ρ² = (Σ_k a_k b_k)² / (Σ_k a_k² Σ_k b_k²)

        of the parameter's ranks a_k and the load factor's ranks b_k over the samples k with a load
        factor, minus their means; equal numbers have their mean rank. Parameters that vary together
        share the variation that they explain, so shares do not add up to 1. Empty if the load
        factor varies by at most 1e-4 of its size, or fewer than three samples have one.
    rock_share : float or None
        Share of the variance of the load factor that a quadratic function of the strengths of a
        tile on all surfaces explains; None with too few samples.
    rock_apart : list of Influence
        The three other parameters that explain most of the rest: squared correlation of parameter
        and load factor, both less what the strengths explain (partial correlation). Parameters that
        explain no more than one in twenty does by chance, 4 over the number of samples, are left
        out.
    threshold : StrengthThreshold or None
        Least strength of rock with which the stance is feasible; None with samples of the caller,
        and where no hand is on rock of the range.
    kept : SentSpread or None
        Tensions (and pose targets) stay as planned, and nobody plans anew. Fixed wrists: palms and
        lateral reactions are those of least utilisation that balance the body. Compliant and
        floating wrists: equilibrium of the body on its limbs and hands, as in `OpenLoop`; requires
        that all wrists move, and the limbs' stiffness. None without it, or without a plan.
    feedback : SentSpread or None
        A controller that knows no strength changes the planned tensions by the least sum of squares
        with which hard rows and balance can be met; reactions as in ``kept``. Where the tensions
        can be kept they are, so that a sample has the same value in both. None where a wrist moves
        (there the limbs balance the body), or without a plan.
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
    rock_share: float | None = None
    rock_apart: list[Influence] = []
    threshold: StrengthThreshold | None = None
    kept: SentSpread | None = None
    feedback: SentSpread | None = None

    @property
    def failing(self) -> str:
        """Why samples with a balance do not hold; only where limbs balance it, tiles may drag."""
        moving = self.kept is not None and self.feedback is None
        return "overloaded or dragged" if moving else "overloaded"

    @property
    def answers(self) -> dict[str, Spread | SentSpread]:
        """Statistics of each way to meet the samples, by its name."""
        every = {
            "planned anew": self,
            "tensions kept": self.kept,
            "balanced by feedback": self.feedback,
        }
        return {words: each for words, each in every.items() if each is not None}

    @classmethod
    def of(
        cls,
        plans: Sequence[DrawnPlan],
        cap: float,
        refused: Mapping[str, int],
        drawn: Mapping[str, Array],
        kept: Sequence[SentPlan] | None = None,
        feedback: Sequence[SentPlan] | None = None,
        threshold: StrengthThreshold | None = None,
        sources: Mapping[str, str] = MappingProxyType({}),
    ) -> Spread:
        """Compute the statistics over the plans of all samples.

        Parameters
        ----------
        plans : sequence of DrawnPlan, length n
        cap : float
            Cap on the utilisation.
        refused : mapping of str to int
            Number of samples in which a hand cannot be closed, by limb.
        drawn : mapping of str to ndarray, shape (n,)
            Values of each uncertain parameter over the samples, by name.
        kept, feedback : sequence of SentPlan, length n, optional
            What the plan's tensions do in each sample, kept or balanced by feedback.
        threshold : StrengthThreshold, optional
        sources : mapping of str to str, optional
            Source of each uncertain parameter, by name.
        """
        used, factors = [p.utilisation for p in plans], [p.load_factor for p in plans]
        influences = _sourced(_influences(factors, drawn), sources)
        rock_share, apart = _apart(factors, drawn)
        carried = [
            0.0 if factor is None and (u is None or u > 1.0) else factor
            for u, factor in zip(used, factors, strict=True)
        ]
        return cls(
            draws=len(plans),
            holds=sum(each.holds for each in plans),
            without=used.count(None),
            cap=cap,
            refused=dict(refused),
            utilisation=Quantiles.of(used),
            load_factor=Quantiles.of(carried) if any(f is not None for f in factors) else None,
            hangs_on=influences,
            utilisations=used,
            load_factors=factors,
            sensitive_to=influences,
            rock_share=rock_share,
            rock_apart=_sourced(apart, sources),
            threshold=threshold,
            kept=SentSpread.of(kept),
            feedback=SentSpread.of(feedback),
        )


def _influences(factors: Sequence[float | None], drawn: Mapping[str, Array]) -> list[Influence]:
    """Return the largest shares of the load factor's variation, the largest first."""
    import numpy as np

    there = [k for k, factor in enumerate(factors) if factor is not None]
    found = np.array([factors[k] for k in there], dtype=float)
    if len(found) < 3 or np.ptp(found) <= SPREAD_SETTINGS.least_variation * np.abs(found).max():
        return []  # of fewer than three a correlation says nothing
    b = _centred_ranks(found, SPREAD_SETTINGS.least_variation * np.abs(found).max())
    shares: dict[bytes, Influence] = {}
    for name, values in drawn.items():
        a = _centred_ranks(values[there])
        if a.any():
            # a quantity that is ordered as one before says the same
            share = float((a @ b) ** 2 / ((a @ a) * (b @ b)))
            shares.setdefault(a.tobytes(), Influence(name, share))
    return sorted(shares.values(), key=lambda each: -each.share)[:3]  # the largest


def _sourced(found: Sequence[Influence], sources: Mapping[str, str]) -> list[Influence]:
    return [Influence(each.quantity, each.share, sources.get(each.quantity, "")) for each in found]


def _apart(
    factors: Sequence[float | None], drawn: Mapping[str, Array]
) -> tuple[float | None, list[Influence]]:
    """Return the strengths' share of the load factor's variance, and the others' of the rest."""
    import numpy as np

    there = [k for k, factor in enumerate(factors) if factor is not None]
    if not there:
        return None, []
    found = np.array([factors[k] for k in there], dtype=float)
    columns = [np.ones(len(there))]
    others: dict[bytes, tuple[str, Array]] = {}
    for name, values in drawn.items():
        own = values[there]
        if np.ptp(own) == 0.0:
            continue
        own = (own - own.mean()) / own.std()
        # strengths of tiles on surfaces
        if name.endswith(".shear_limit"):
            columns += [own, own**2]
        else:
            # a quantity that goes with one before says the same
            others.setdefault(own.round(9).tobytes(), (name, own))
    # two more than numbers that are fitted, or nothing is left
    few = len(there) < len(columns) + 2
    if few or np.ptp(found) <= SPREAD_SETTINGS.least_variation * np.abs(found).max():
        return None, []
    explained = np.linalg.qr(np.column_stack(columns))[0]

    def rest(values: Array) -> Array:
        return np.asarray(values - explained @ (explained.T @ values))

    left, whole = rest(found), found - found.mean()
    chance = SPREAD_SETTINGS.chance / len(there)
    shares = []
    for name, own in others.values():
        part = rest(own)
        both = float(part @ part) * float(left @ left)
        share = float(part @ left) ** 2 / both if both > SPREAD_SETTINGS.least_rest else 0.0
        shares.append(Influence(name, share))
    largest = sorted(shares, key=lambda each: -each.share)[:3]
    share = 1.0 - float(left @ left) / float(whole @ whole)
    return share, [each for each in largest if each.share > chance]


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
