"""Survival of a plan: whether tiles slip, and whether all hands hold if some do."""

from __future__ import annotations

import math

from msgspec import Struct

__all__ = ["Slip", "StrengthSource", "Survival", "SurvivalShare"]


class SurvivalShare(Struct, frozen=True):
    """Probability from n draws, with its interval of 95 % (Wilson).

    Attributes
    ----------
    probability : float
    low, high : float
    draws : int
    """

    probability: float
    low: float
    high: float
    draws: int

    @classmethod
    def of(cls, count: int, draws: int) -> SurvivalShare:
        """Return the share of draws, ``count`` of ``draws``."""
        z, share = 1.959963984540054, count / draws
        middle = (share + z**2 / (2 * draws)) / (1.0 + z**2 / draws)
        wide = share * (1.0 - share) / draws + z**2 / (4.0 * draws**2)
        wide = z * math.sqrt(wide) / (1.0 + z**2 / draws)
        return cls(share, max(min(middle - wide, share), 0.0), max(middle + wide, share), draws)


class StrengthSource(Struct, frozen=True):
    """Weibull distribution of the tiles on one surface.

    Attributes
    ----------
    surface : str or None
        Name of the preset; None for a caller's numbers.
    modulus : float
        m of a tile's strength.
    variation : float
        Coefficient of variation of a tile's strength, from which the modulus follows.
    source : str
        Origin of the variation: ``paper``, ``measured``, ``calibrated``, ``assumed`` or ``given``.
    mean : float
        Mean strength of one tile over the surface's strength: above 1 where that was fitted to the
        first failures of several tiles.
    """

    surface: str | None
    modulus: float
    variation: float
    source: str
    mean: float


class Slip(Struct, frozen=True):
    """One slip of a cascade.

    Attributes
    ----------
    limb : str
    finger : str or None
        None of a palm.
    phalanx : str
        ``palm`` of a palm.
    load : float
        Load over strength at which the tile or palm slipped.
    most : float
        Largest load over strength of the others afterwards; infinite values are None.
    """

    limb: str
    finger: str | None
    phalanx: str
    load: float
    most: float | None


class Survival(Struct, frozen=True, kw_only=True):
    """Two probabilities of a plan, which rank plans differently: no tile slips, all hands hold.

    Attributes
    ----------
    no_slip : float
        Probability that no finger's tile and no palm slips, by the formula, with the factors of
        holds and rock. (`Reliability.no_slip` counts tiles alone, without these factors.)
    strength_90, strength_99 : float
        Factor of the assumed mean strengths, whatever ``strength`` is, at which ``no_slip`` is 0.9,
        and 0.99.
    holds : SurvivalShare or None
        All hands hold at last, tensions fixed; None where ``reason`` says why, and where a deadline
        has left no time for any draw. It may leave fewer draws than were asked for.
    replanned : SurvivalShare or None
        All hands hold with new set-points after each slip; None where they were not asked for, too.
    slipped : SurvivalShare or None
        Draws in which anything slips, to be compared with 1 − ``no_slip``.
    strength : float
        Factor of all mean strengths for which the probabilities are.
    hold_scatter, rock_scatter : float
        Standard deviation of the logarithm of each hold's factor and of the rock's.
    delay : float
        Time from a slip to new set-points [s].
    seed : int
    surfaces : list of StrengthSource
    first : dict of str to float
        Share of all draws in which a tile or palm slips first, by its name; the ten likeliest.
    cascade : list of Slip
        Slips at fixed tensions in the draw with most of them; empty if nothing slips.
    cascade_holds : bool
        Whether all hands hold after that cascade.
    reason : str or None
        Why nothing was simulated.
    """

    no_slip: float
    strength_90: float
    strength_99: float
    holds: SurvivalShare | None = None
    replanned: SurvivalShare | None = None
    slipped: SurvivalShare | None = None
    strength: float = 1.0
    hold_scatter: float
    rock_scatter: float
    delay: float
    seed: int
    surfaces: list[StrengthSource]
    first: dict[str, float] = {}
    cascade: list[Slip] = []
    cascade_holds: bool = True
    reason: str | None = None

    @property
    def moduli(self) -> str:
        """Weibull modulus of each surface with its source, as words."""
        return ", ".join(
            f"m = {s.modulus:.3g} on {s.surface or 'own surface'} ({s.source})"
            for s in self.surfaces
        )

    @property
    def tail(self) -> str | None:
        """Sentence about a survival above 0.95; None if there is none."""
        shares = [share.probability for share in (self.holds, self.replanned) if share is not None]
        if max([self.no_slip, *shares]) <= 0.95:
            return None
        each = ", ".join(
            f"m = {s.modulus:.2g} on {s.surface or 'own surface'} (scatter {s.variation:g}, "
            f"{s.source})"
            for s in self.surfaces
        )
        return (
            "survival above 0.95 rests on the weakest few of all tiles, which nobody has measured: "
            f"Weibull modulus {each}"
        )
