"""Strength of a tile as an array of linearly constrained spines, by Monte Carlo simulation.

The laws are those of Wang, Jiang, Cutkosky (IJRR 2017), the model [16] behind Section 5.5 and
Appendix 9.4. Spines slide freely along channels, tilted by β from the tile's normal, and are
dragged together. A spine that finds an asperity carries up to Φ_i (a Gaussian cut to the strength
of asperities and of the shaft), after the play S_i ~ U(0, backlash) of its channel is taken up. The
first spine to reach its limit ends the travel X of all, and the tile carries

    X = min_i (Φ_i / k + S_i),     F = Σ_i k max(X − S_i, 0),

with k the stiffness of a spine on its asperity.

Asperities have slopes ψ with a linear density f on [ψ_min, ψ_max] that is zero at ψ_max. Loaded at
the angle φ toward pull-off, a spine stays on those with ψ ≥ φ + π/2 − atan μ; on those steeper than
β + π/2 − α/2 its shaft is in touch, not its tip, and it carries c_i of its strength (C_i); and
beyond the friction cone of its channel, φ > β + atan μ_s, it slips there and carries

    C_c = cos(φ − β + atan μ_s) (1 + μ_s²).

Loaded at the azimuth θ from the drag, β becomes asin(sin β cos θ). Spine i of a trial then carries

    w_i F_i,   w_i = C_c C_i(ψ_i) [ψ_i ≥ φ + π/2 − atan μ] / ∫ C_i f dψ |_(φ = θ = 0),

whose mean is the published law F(φ, θ) = F(0, 0) ∫ C_c C_i f dψ / (the same at φ = θ = 0). Pressed
(φ < 0), the tile's body adds Coulomb friction: F(0, θ) / (cos φ + μ_t sin φ).

Chosen here, since nothing is printed: asperities are independent between spines and trials; the
channel's law is used as printed, which drops by μ_s² at the edge of the cone; the lower edge of the
cone is never reached, as μ_s ≥ tan β.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import spine_table

__all__ = ["SpineArray", "Statistics", "spine_forces", "statistics"]


class Statistics(NamedTuple):
    """Mean, standard deviation and quantiles of simulated tile strengths, for each direction.

    Attributes
    ----------
    mean, deviation : ndarray, shape (...)
        Mean and standard deviation for each direction of load [N].
    quantiles : ndarray, shape (3, ...)
        5, 50 and 95 % quantiles [N].
    """

    mean: Array
    deviation: Array
    quantiles: Array


def statistics(strengths: Array) -> Statistics:
    """Return mean, standard deviation and quantiles of strengths (trials, ...) over trials [N]."""
    return Statistics(
        strengths.mean(axis=0),
        strengths.std(axis=0, ddof=1),
        np.quantile(strengths, (0.05, 0.5, 0.95), axis=0),
    )


def spine_forces(limits: Array, play: Array, stiffness: float) -> Array:
    """Return the force of every spine of a tile when the first of them reaches its limit.

    Parameters
    ----------
    limits : ndarray, shape (..., spines)
        Φ_i, strength of each spine on its asperity [N]; infinite where it found none.
    play : ndarray, shape (..., spines)
        S_i, play of each spine in its channel [m].
    stiffness : float
        k of one spine on its asperity [N/m].

    Returns
    -------
    ndarray, shape (..., spines)
        F_i [N], zero for spines on no asperity.
    """
    caught = np.isfinite(limits)
    travel = np.where(caught, limits / stiffness + play, np.inf).min(axis=-1, keepdims=True)
    travel = np.where(np.isfinite(travel), travel, 0.0)
    return np.where(caught, stiffness * np.maximum(travel - play, 0.0), 0.0)


@dataclass(frozen=True)
class SpineArray:
    """Spines of one tile and asperities of the rock, with the names of ``parameters/spines.toml``.

    Attributes
    ----------
    spines : int
        Count of spines.
    backlash : float
        Largest play of a spine in its channel [m].
    contact_stiffness : float
        k, stiffness of a spine on its asperity [N/m].
    channel_tilt, tip_cone : float
        β, tilt of the channels from the tile's normal; α, cone angle of the tips [rad].
    shaft_strength : float
        Largest force on a shaft [N].
    channel_friction, asperity_friction, tile_friction : float
        μ_s in the channel, μ between spine and asperity, μ_t between tile and rock.
    shaft_contact : float
        c_i, share of its strength that a spine has on its shaft, from 0 to 1.
    slope_min, slope_max : float
        ψ_min and ψ_max, range of the asperities' slopes [rad].
    asperity_fraction : float
        Probability that a spine finds an asperity.
    strength_mean, strength_deviation : float
        Mean and standard deviation of an asperity's strength, a Gaussian before it is cut to
        (0, shaft_strength) [N].

    Raises
    ------
    InvalidInputError
        If a number is not finite or out of its range.
    """

    spines: int
    backlash: float
    contact_stiffness: float
    channel_tilt: float
    tip_cone: float
    shaft_strength: float
    channel_friction: float
    asperity_friction: float
    tile_friction: float
    shaft_contact: float
    slope_min: float
    slope_max: float
    asperity_fraction: float
    strength_mean: float
    strength_deviation: float

    def __post_init__(self) -> None:
        def check(name: str, valid: bool, needed: str) -> None:
            if not valid:
                raise InvalidInputError(
                    f"must be {needed}, got {getattr(self, name):g}", field=name
                )

        for field in fields(self):
            value = getattr(self, field.name)
            check(field.name, math.isfinite(value) and value >= 0.0, "finite and not negative")
        for name in ("contact_stiffness", "shaft_strength", "strength_deviation"):
            check(name, getattr(self, name) > 0.0, "above 0")
        check(
            "spines",
            self.spines >= 1 and self.spines == int(self.spines),
            "a whole number of at least 1",
        )
        for name in ("shaft_contact", "asperity_fraction"):
            check(name, getattr(self, name) <= 1.0, "from 0 to 1")
        least = math.tan(self.channel_tilt)
        needed = f"at least tan(channel_tilt) = {least:.3g}"
        check("channel_friction", self.channel_friction >= least, needed)
        needed = "above slope_min and at most pi"
        check("slope_max", self.slope_min < self.slope_max <= math.pi, needed)

    @classmethod
    def named(cls, surface: str) -> SpineArray:
        """Return the spine array of a SpinyHand tile on a preset surface.

        Raises
        ------
        InvalidInputError
            If no preset has that name; the message lists the names.
        """
        table = spine_table()
        own = table.sections.get(surface, {})
        known = [name for name, entries in table.sections.items() if "strength_mean" in entries]
        if surface not in known:
            raise InvalidInputError(
                f"unknown surface {surface!r}; known are {', '.join(known)}", field="surface"
            )
        values = {
            field.name: table.scalar(surface if field.name in own else "array", field.name)
            for field in fields(cls)
        }
        return cls(spines=int(values.pop("spines")), **values)

    def share(self, angle: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
        """Return mean strength in a direction over that in pure drag, in closed form.

        Parameters
        ----------
        angle : array_like
            φ from the tile's plane toward pull-off, in [−π/2, π/2] [rad].
        azimuth : array_like
            θ in the tile's plane from the drag [rad]; broadcast with ``angle``.

        Returns
        -------
        ndarray
            F(φ, θ) / F(0, 0); infinite where pressing adds more friction than the load needs.
        """
        phi, theta = np.broadcast_arrays(np.asarray(angle, float), np.asarray(azimuth, float))
        pull = np.maximum(phi, 0.0)
        least, steep = self._least_slope(pull), self._shaft_slope(theta)
        both = np.maximum(least, steep)
        tip = self._steeper(least) - self._steeper(both)
        shaft = self.shaft_contact * self._steeper(both)
        share = self._channel(pull, theta) * (tip + shaft) / self._drag_share()
        return np.asarray(share * self._pressing(phi))

    def simulate(
        self,
        rng: np.random.Generator,
        trials: int,
        angle: ArrayLike = 0.0,
        azimuth: ArrayLike = 0.0,
    ) -> Array:
        """Return Monte Carlo samples of a tile's strength in given directions of load.

        Each trial puts the tile on a new place of the rock, and loads it there in every direction.

        Parameters
        ----------
        rng : numpy.random.Generator
        trials : int
            Count of samples.
        angle, azimuth : array_like
            φ and θ of the load, as for `share` [rad].

        Returns
        -------
        ndarray, shape (trials, ...)
            Strength F of each trial in each direction [N]; infinite where the friction of pressing
            alone carries any load.
        """
        phi, theta = np.broadcast_arrays(np.asarray(angle, float), np.asarray(azimuth, float))
        size = (trials, self.spines)
        forces = self._drag_forces(rng, size)
        # the inverse of the distribution of slopes: 1 − (1 − (ψ − ψ_min) / d)²
        slopes = self.slope_max - (self.slope_max - self.slope_min) * np.sqrt(rng.random(size))
        strengths = np.zeros((trials, phi.size))
        for j, (a, t) in enumerate(zip(phi.ravel(), theta.ravel(), strict=True)):
            pull = np.array(max(a, 0.0))
            weight = np.where(slopes <= self._shaft_slope(t), 1.0, self.shaft_contact)
            held = (forces * weight * (slopes >= self._least_slope(pull))).sum(axis=1)
            held = held * self._channel(pull, t) / self._drag_share()
            np.multiply(held, self._pressing(a), out=strengths[:, j], where=held > 0.0)
        return strengths.reshape(trials, *phi.shape)

    def simulate_drag(self, rng: np.random.Generator, trials: int) -> Array:
        """Return Monte Carlo samples of a tile's strength Σ F_i in pure drag.

        Their mean is that of `simulate` at φ = θ = 0.

        Returns
        -------
        ndarray, shape (trials,)
            Strength of each trial [N].
        """
        return np.asarray(self._drag_forces(rng, (trials, self.spines)).sum(axis=1))

    def _drag_forces(self, rng: np.random.Generator, size: tuple[int, int]) -> Array:
        """Return F_i of every spine of every trial [N]."""
        low = scipy.special.ndtr(-self.strength_mean / self.strength_deviation)
        high = scipy.special.ndtr(
            (self.shaft_strength - self.strength_mean) / self.strength_deviation
        )
        within = low + (high - low) * rng.random(size)
        limits = self.strength_mean + self.strength_deviation * scipy.special.ndtri(within)
        limits = np.where(rng.random(size) < self.asperity_fraction, limits, np.inf)
        return spine_forces(limits, self.backlash * rng.random(size), self.contact_stiffness)

    def _least_slope(self, pull: ArrayLike) -> Array:
        """Return the least slope on which a tip stays [rad]."""
        return np.asarray(pull) + math.pi / 2 - math.atan(self.asperity_friction)

    def _tilt(self, azimuth: ArrayLike) -> Array:
        """Return β as it is in the plane of the load [rad]."""
        return np.asarray(np.arcsin(math.sin(self.channel_tilt) * np.cos(azimuth)))

    def _shaft_slope(self, azimuth: ArrayLike) -> Array:
        """Return the slope from which on the shaft touches, not the tip [rad]."""
        return self._tilt(azimuth) + math.pi / 2 - self.tip_cone / 2

    def _steeper(self, slope: Array) -> Array:
        """Return the part of the asperities that is steeper than a slope."""
        inside = np.clip(slope, self.slope_min, self.slope_max)
        return np.asarray(((self.slope_max - inside) / (self.slope_max - self.slope_min)) ** 2)

    def _drag_share(self) -> float:
        """Return ∫ C_i f dψ in pure drag, where no channel slips."""
        least = self._least_slope(0.0)
        both = np.maximum(least, self._shaft_slope(0.0))
        tip = self._steeper(least) - self._steeper(both)
        return float(tip + self.shaft_contact * self._steeper(both))

    def _channel(self, pull: Array, azimuth: ArrayLike) -> Array:
        """Return C_c."""
        cone = math.atan(self.channel_friction)
        beyond = pull - self._tilt(azimuth)
        slipping = np.maximum(np.cos(beyond + cone), 0.0) * (1.0 + self.channel_friction**2)
        return np.where(beyond <= cone, 1.0, slipping)

    def _pressing(self, angle: ArrayLike) -> Array:
        """Return what a pressed tile's own friction multiplies its strength by."""
        press = np.minimum(angle, 0.0)
        left = np.cos(press) + self.tile_friction * np.sin(press)
        with np.errstate(divide="ignore"):
            return np.where(left > 0.0, 1.0 / np.maximum(left, 0.0), np.inf)
