"""Strengths of tiles as random numbers: how likely it is that no tile slips, and samples.

Spines catch by chance. The strength of a tile over that of its surface is taken as

    s = c R G_h w,

with w of a Weibull distribution of the modulus m, R a factor of the rock that all hands share, G_h
one of the hold that all tiles of hand h share, both log-normal of mean 1, and c a factor of the
caller's, 1 if the numbers are right. A tile that uses u of its strength slips if u > s. With the
factors known, no tile slips with the probability exp(−Σ_h H_h (c R G_h)^(−m_h)), where

    H_h = Σ_tiles (u Γ(1 + 1/m) / w̄)^m

is the hazard of hand h and w̄ the mean of w; tiles without load or pressed ones (u ≤ 0) add nothing.
Gauss–Hermite quadrature over the logarithms of R and G_h gives the mean.

The modulus has the coefficient of variation that the surface's scatter gives (`weibull_modulus`).
A strength that was fitted to the first failures of k tiles is the mean of the weakest of k already:
the mean of one tile is k^(1/m) times as large, and that of the weakest of n is (k/n)^(1/m) times
the surface's strength.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy

from hand_models.base import Array, Indices, InvalidInputError
from hand_models.parameters import strength_table
from hand_models.tile.surface import Surface

__all__ = ["StrengthScatter", "TileStrengths", "weibull_modulus"]


@dataclass(frozen=True, slots=True)
class StrengthSettings:
    """Fineness of distributions of strength."""

    nodes: int = 64  # of quadrature; with 16 an error of 0.006 is left at a scatter of 0.78
    least_scatter: float = 1e-4
    """Least coefficient of variation of a tile: less is as good as none, a modulus of 13,000."""
    most_log: float = 12.0  # of the logarithm of a factor that is sought, of either sign


STRENGTH_SETTINGS: Final = StrengthSettings()


def weibull_modulus(variation: float) -> float:
    """Return the modulus m of the Weibull distribution with a coefficient of variation.

    The positive root of Γ(1 + 2/m) / Γ(1 + 1/m)² = 1 + CV².

    Parameters
    ----------
    variation : float
        Standard deviation over mean; below 1e-4 it counts as 1e-4.

    Raises
    ------
    InvalidInputError
        If it is not finite, negative or above 100.
    """
    if not 0.0 <= variation <= 100.0:
        raise InvalidInputError(
            f"a coefficient of variation must be 0 to 100, got {variation:g}", field="variation"
        )
    aim = math.log1p(max(variation, STRENGTH_SETTINGS.least_scatter) ** 2)
    low, high = 0.0, 20.0  # of 1/m
    # to the last digit, on which the last digits of the plan of least hazard depend
    for _ in range(70):
        x = 0.5 * (low + high)
        if math.lgamma(1.0 + 2.0 * x) - 2.0 * math.lgamma(1.0 + x) < aim:
            low = x
        else:
            high = x
    return 1.0 / x


@dataclass(frozen=True)
class StrengthScatter:
    """Scatter of what tiles have in common.

    Attributes
    ----------
    hold, rock : float
        Standard deviation of the logarithm of a hold's factor and of the rock's.
    """

    hold: float
    rock: float

    @classmethod
    def bundled(cls, hold: float | None = None, rock: float | None = None) -> StrengthScatter:
        """Return the scatter of ``strength.toml``, with a caller's own numbers in their place."""
        table = strength_table()
        return cls(
            table.scalar("factors", "hold") if hold is None else hold,
            table.scalar("factors", "rock") if rock is None else rock,
        )

    def sample_rock(self, draws: int, seed: int | Sequence[int]) -> Array:
        """Return samples of the rock's factor, of mean 1, shape (draws,)."""
        return _factors(np.random.default_rng(seed), self.rock, (draws, 1))[:, 0]


@dataclass(frozen=True, eq=False)
class TileStrengths:
    """Distribution of the strengths of the T tiles of H hands, over those of their surfaces.

    Attributes
    ----------
    modulus, mean : ndarray, shape (H,)
        m and w̄ of the tiles of each hand.
    hand : ndarray of int, shape (T,)
        Hand of each tile.
    scatter : StrengthScatter
    """

    modulus: Array
    mean: Array
    hand: Indices
    scatter: StrengthScatter

    @classmethod
    def of(
        cls,
        surfaces: Sequence[Surface],
        hand: Indices,
        scatter: StrengthScatter | None = None,
        weakest_of: float | None = None,
    ) -> TileStrengths:
        """Return the distribution of tiles on given surfaces.

        Parameters
        ----------
        surfaces : sequence of Surface, length H
            Surface of each hand.
        hand : ndarray of int, shape (T,)
            Hand of each tile.
        scatter : StrengthScatter, optional
            That of ``strength.toml`` by default.
        weakest_of : float, optional
            Number of tiles to whose first failure each strength was fitted; by default that of
            ``strength.toml`` for the surface's name.
        """
        table = strength_table()
        known = table.sections["weakest_of"]
        modulus = np.array([weibull_modulus(s.shear_scatter / s.shear_limit) for s in surfaces])
        of = [
            table.scalar("weakest_of", s.name if s.name in known else "default")
            if weakest_of is None
            else weakest_of
            for s in surfaces
        ]
        return cls(
            modulus,
            np.array(of) ** (1.0 / modulus),
            hand,
            StrengthScatter.bundled() if scatter is None else scatter,
        )

    def log_hazards(self, used: Array) -> Array:
        """Return the logarithm of the hazard H_h of each hand, shape (H,); −∞ without load.

        ``used``: utilisation u of each tile's surface strength, shape (T,).
        """
        m = self.modulus
        gammas = np.array([math.lgamma(1.0 + 1.0 / each) for each in m.tolist()])
        loaded = np.asarray(used) > 0.0
        of = self.hand[loaded]
        logs = m[of] * (np.log(used[loaded]) + (gammas - np.log(self.mean))[of])
        found = np.full(len(m), -np.inf)
        np.logaddexp.at(found, of, logs)
        return found

    def no_slip(self, used: Array, factor: float = 1.0) -> float:
        """Return the probability that no tile slips.

        Parameters
        ----------
        used : ndarray, shape (T,)
            Utilisation u of each tile's surface strength.
        factor : float, optional
            c, above 0.
        """
        return self._no_slip(self.log_hazards(used))(math.log(factor))

    def factor_for(self, used: Array, probability: float) -> float:
        """Return the factor c at which no tile slips with a given probability; 0 without load.

        Parameters
        ----------
        used : ndarray, shape (T,)
            Utilisation u of each tile's surface strength.
        probability : float
            Between 0 and 1.
        """
        hazards = self.log_hazards(used)
        if not np.isfinite(hazards).any():
            return 0.0
        no_slip = self._no_slip(hazards)
        ends = -STRENGTH_SETTINGS.most_log, STRENGTH_SETTINGS.most_log

        def short(log_factor: float) -> float:
            return no_slip(log_factor) - probability

        if short(ends[0]) >= 0.0 or short(ends[1]) <= 0.0:
            return math.exp(ends[0] if short(ends[0]) >= 0.0 else ends[1])
        return math.exp(scipy.optimize.brentq(short, *ends, xtol=1e-15, rtol=1e-15))

    def _no_slip(self, log_hazards: Array) -> Callable[[float], float]:
        """Return the probability that no tile slips, as a function of the logarithm of c."""
        nodes, weights = np.polynomial.hermite_e.hermegauss(STRENGTH_SETTINGS.nodes)
        weights /= weights.sum()
        # over the logarithms of factors of mean 1
        (rock, of_rock), (hold, of_hold) = (
            (spread * nodes - 0.5 * spread**2, weights) if spread else (np.zeros(1), np.ones(1))
            for spread in (self.scatter.rock, self.scatter.hold)
        )

        def probability(log_factor: float) -> float:
            logs = rock[:, None, None] + hold[:, None] + log_factor
            with np.errstate(over="ignore"):
                held = np.exp(-np.exp(log_hazards - self.modulus * logs))
            return float(of_rock @ np.prod(np.einsum("klh,l->kh", held, of_hold), axis=1))

        return probability

    def sample(
        self,
        draws: int,
        seed: int | Sequence[int] | np.random.SeedSequence,
        factor: float = 1.0,
    ) -> Array:
        """Return samples of the strength of each tile over that of its surface, shape (draws, T).

        Parameters
        ----------
        draws : int
        seed : int, sequence of int or SeedSequence
            The same seed gives the same samples.
        factor : float, optional
            c, above 0.
        """
        rng, m = np.random.default_rng(seed), self.modulus
        unit = self.mean / np.exp([math.lgamma(1.0 + 1.0 / each) for each in m.tolist()])
        found = rng.standard_exponential((draws, len(self.hand))) ** (1.0 / m[self.hand])
        found *= unit[self.hand]
        for spread, count in ((self.scatter.rock, 1), (self.scatter.hold, len(m))):
            of = _factors(rng, spread, (draws, count))
            found *= of if count == 1 else of[:, self.hand]
        return np.asarray(factor * found)


def _factors(rng: np.random.Generator, spread: float, shape: tuple[int, int]) -> Array:
    """Return samples of log-normal factors of mean 1."""
    return np.asarray(np.exp(spread * rng.standard_normal(shape) - 0.5 * spread**2))
