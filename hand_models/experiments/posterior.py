"""Posterior of a gripper's parameters: sets that agree with the data, as far as the model can.

The prior is even over plausible ranges, the likelihood normal with `GripperFit.deviations`. Between
sets at which the model was computed, an emulator stands for it: each datum a quadratic function of
the parameters, fitted with more weight to sets that agree better, and the variance that it leaves
is added. Markov chains on the emulator (affine invariant stretch moves: Goodman and Weare, 2010)
find where to compute the model next. After some waves of this, the last wave's sets are importance
samples: their weights are the model's likelihood over the emulator's.

The same runs without the data of one figure at a time. Of these comes the discrepancy δ: the rms of
how far data that were left out are from the mean of the samples, less the error of reading them.
Every number is a sum or a least-squares solution, none an eigenvector with a sign of its own: one
seed gives one result.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError
from hand_models.experiments.gripper_fit import FITTED_FIGURES, GripperFit
from hand_models.tile import Surface

Flags = NDArray[np.bool_]

__all__ = ["POSTERIOR_SETTINGS", "Posterior", "PosteriorSettings", "Sampled", "as_draws"]


@dataclass(frozen=True, slots=True)
class PosteriorSettings:
    """Effort of a posterior, and constants of its emulator."""

    first_sets: int = 1600
    """Number of sets about the recorded one at which the model is computed first."""
    waves: int = 2
    wave_sets: int = 150
    """Number of further waves, and of sets of each for every choice of data."""
    last_sets: int = 450
    """Number of sets of the last wave, with all data; a third of it without a figure's."""
    spread: float = 0.12
    """Standard deviation of the first sets, as a share of plausible ranges."""
    walkers: int = 200
    steps: int = 1500
    """Number of chains on the emulator, and of their steps; the first third is left out."""
    temperature: float = 8.0
    """By which a set's χ² beyond the least, halved, counts less in the emulator."""
    seed: int = 1
    """Of all random numbers."""


POSTERIOR_SETTINGS: Final = PosteriorSettings()


@dataclass(frozen=True, eq=False)
class Sampled:
    """Weighted samples of a posterior.

    Attributes
    ----------
    sets : ndarray, shape (m, n)
        Parameters as shares of plausible ranges.
    values : ndarray, shape (m, k)
        The model's values of the data there.
    weights : ndarray, shape (m,)
        Their sum is 1.
    """

    sets: Array
    values: Array
    weights: Array

    @property
    def effective(self) -> float:
        """Number of even samples that have the same variance, 1 / Σ w²."""
        return float(1.0 / (self.weights**2).sum())

    def quantiles(self, wide: Array) -> Array:
        """Return the quantiles of 5, 50 and 95 %, shape (3, k), of what is measured.

        That is a deviation, ``wide`` (k,), about the model's value.
        """
        # the normal distribution about each sample, by 51 of its own quantiles
        even = scipy.special.ndtri((np.arange(51) + 0.5) / 51.0)
        parts = self.values[:, None, :] + even[:, None] * wide
        weights = np.repeat(self.weights / len(even), len(even))
        found = []
        for each in parts.reshape(len(weights), -1).T:
            order = each.argsort()
            middles = weights[order].cumsum() - 0.5 * weights[order]
            found.append(np.interp((0.05, 0.5, 0.95), middles, each[order]))
        return np.transpose(found)

    def chosen(self, count: int) -> list[int]:
        """Return indices of ``count`` samples of even weight: systematic resampling, each once.

        Raises
        ------
        InvalidInputError
            If there are fewer samples.
        """
        if (there := int((self.weights > 0.0).sum())) < count:
            raise InvalidInputError(f"at least {count} samples are needed, got {there}")
        picked: list[int] = []
        ends, tried = self.weights.cumsum(), count
        # where one sample is picked several times, more finely
        while len(picked) < count:
            steps = (np.arange(tried) + 0.5) / tried * ends[-1]
            picked = list(dict.fromkeys(np.searchsorted(ends, steps).tolist()))
            tried += 1
        return picked[:count]


@dataclass(eq=False)
class Posterior:
    """Search for the posterior of a gripper's parameters, with and without each figure's data.

    Attributes
    ----------
    fit : GripperFit
    effort : PosteriorSettings
    discrepancy : float
        δ, which the search replaces wave by wave [1].
    sets, values : ndarray
        All sets at which the model was computed (m, n), and its values there (m, k).
    """

    fit: GripperFit
    effort: PosteriorSettings = POSTERIOR_SETTINGS
    discrepancy: float = 0.15
    sets: Array = field(init=False)
    values: Array = field(init=False)

    def __post_init__(self) -> None:
        self.sets = np.zeros((0, len(self.fit.numbers)))
        self.values = np.zeros((0, len(self.fit.data)))
        self._rng = np.random.default_rng(self.effort.seed)

    @property
    def evaluations(self) -> int:
        """Number of sets at which `run` computes the model."""
        each, waves = len(FITTED_FIGURES) + 1, self.effort
        last = waves.last_sets + len(FITTED_FIGURES) * (waves.last_sets // 3)
        return waves.first_sets + waves.waves * each * waves.wave_sets + last

    def run(self, tick: Callable[[], None]) -> dict[str, Sampled]:
        """Return samples of the posterior with all data, ``""``, and without each figure's.

        Parameters
        ----------
        tick : callable
            Called after each set at which the model was computed.
        """
        choices = {"": np.ones(len(self.fit.data), dtype=bool)}
        choices |= {figure: self.fit.figures != figure for figure in FITTED_FIGURES}
        start = self.fit.start()
        shape = (self.effort.first_sets, len(start))
        away = start + self.effort.spread * self._rng.standard_normal(shape)
        self._compute(np.vstack([start, _within(away)])[:-1], tick)
        for _ in range(self.effort.waves):
            drawn = [self._emulated(used, self.effort.wave_sets)[0] for used in choices.values()]
            found = [self._compute(sets, tick) for sets in drawn]
            self.discrepancy = self._left_out(list(zip(choices.values(), found, strict=True)))
        samples = {}
        for name, used in choices.items():
            count = self.effort.last_sets if not name else self.effort.last_sets // 3
            sets, logs = self._emulated(used, count)
            values = self._compute(sets, tick)
            there = np.isfinite(values).all(axis=1)
            gain = self.log_likelihood(values[there], used) - logs[there]
            weights = np.exp(gain - gain.max())
            samples[name] = Sampled(sets[there], values[there], weights / weights.sum())
        return samples

    def log_likelihood(self, values: Array, used: Flags, added: Array | None = None) -> Array:
        """Return the logarithm of the likelihood (m,) of values (m, k), less a constant.

        Parameters
        ----------
        values : ndarray, shape (m, k)
        used : ndarray of bool, shape (k,)
            The data that count.
        added : ndarray, shape (k,), optional
            Variances to add.
        """
        wide = self.fit.deviations(self.discrepancy)
        if added is not None:
            wide = np.sqrt(wide**2 + added)
        off = ((values - self.fit.wanted) / wide)[:, used]
        return np.asarray(-0.5 * (off**2).sum(axis=1) - np.log(wide[used]).sum())

    def likeliest(self) -> Array:
        """Return the likeliest set (n,) of all at which the model was computed, by all data."""
        there, everything = np.isfinite(self.values).all(axis=1), np.isfinite(self.fit.wanted)
        logs = self.log_likelihood(self.values[there], everything)
        return np.asarray(self.sets[there][logs.argmax()])

    def _compute(self, sets: Array, tick: Callable[[], None]) -> Array:
        """Return the model's values of new sets, and keep them."""
        found = []
        for x in sets:
            found.append(self.fit.models(x[None])[0])
            tick()
        self.sets = np.vstack([self.sets, sets])
        self.values = np.vstack([self.values, found])
        return np.array(found)

    def _emulator(self, used: Flags) -> tuple[Array, Array, Array]:
        """Return coefficients of the emulator, the variances it leaves, and its best sets."""
        there = np.isfinite(self.values).all(axis=1)
        sets, values = self.sets[there], self.values[there]
        logs = self.log_likelihood(values, used)
        weights = np.exp((logs - logs.max()) / self.effort.temperature)
        # no set is quite without weight, so that the function is bounded everywhere
        weights = np.maximum(weights, 1e-4)
        root = np.sqrt(weights)[:, None]
        terms = _terms(sets)
        found = np.linalg.lstsq(root * terms, root * values, rcond=None)[0]
        left = (weights[:, None] * (values - terms @ found) ** 2).sum(axis=0) / weights.sum()
        best = np.argsort(-logs, kind="stable")[: self.effort.walkers]
        return found, left, sets[best]

    def _emulated(self, used: Flags, count: int) -> tuple[Array, Array]:
        """Return sets of the emulated posterior, and the logarithms of their likelihoods."""
        emulator, left, walkers = self._emulator(used)

        def logs(x: Array) -> Array:
            found = self.log_likelihood(_terms(x) @ emulator, used, left)
            return np.where(((x >= 0.0) & (x <= 1.0)).all(axis=1), found, -np.inf)

        rng, (m, n) = self._rng, walkers.shape
        half, now = m // 2, logs(walkers)
        kept, known = [], []
        for step in range(self.effort.steps):
            for mine, other in ((slice(0, half), slice(half, m)), (slice(half, m), slice(0, half))):
                size = len(now[mine])
                # a density ∝ 1 / √z between 1/2 and 2
                stretch = (1.0 + rng.random(size)) ** 2 / 2.0
                mates = walkers[other][rng.integers(len(now[other]), size=size)]
                tried = mates + stretch[:, None] * (walkers[mine] - mates)
                there = logs(tried)
                gain = (n - 1) * np.log(stretch) + there - now[mine]
                moved = np.log(rng.random(size)) < gain
                walkers[mine] = np.where(moved[:, None], tried, walkers[mine])
                now[mine] = np.where(moved, there, now[mine])
            if step >= self.effort.steps // 3 and step % 10 == 0:
                kept.append(walkers.copy())
                known.append(now.copy())
        sets, found = np.vstack(kept), np.concatenate(known)
        taken = rng.choice(len(sets), count, replace=False)
        return sets[taken], found[taken]

    def _left_out(self, found: Sequence[tuple[Flags, Array]]) -> float:
        """Return δ, each figure's data alike, however many it has.

        ``found`` has the data used, and the model's values at sets that agree with these.
        """
        fit, squares = self.fit, []
        for used, values in found:
            if not used.all():
                mean = values[np.isfinite(values).all(axis=1)].mean(axis=0)
                off = ((mean - fit.wanted) ** 2 - fit.reading**2) / fit.size**2
                squares.append(max(float(off[~used].mean()), 0.0))
        return float(np.sqrt(np.mean(squares)))


def as_draws(data: Mapping[str, Any]) -> str:
    """Return the kept sets of a study's data as text in the form of ``draws.toml``.

    ``python -m hand_models.studies.calibrate DIR/result.json`` prints the text.

    Parameters
    ----------
    data : mapping
        ``data`` of the study's result, read from ``result.json``.
    """
    sets, names = data["sets"], [number["name"] for number in data["numbers"]]
    columns = dict(zip(names, np.transpose([each["values"] for each in sets]), strict=True))
    angle, slopes = Surface.named("sandpaper-36").pull_off_angle, columns["pull_off_slope"]
    columns["pull_off_ratio"] = 1.0 / (np.cos(angle) + slopes * np.sin(angle))
    columns["misfit"] = np.array([each["misfit"] for each in sets])

    def replaced(entry: re.Match[str]) -> str:
        values = ", ".join(f"{value:.4g}" for value in columns[entry["name"]])
        return f"{entry['before']}[{values}]"

    bundled = resources.files("hand_models.parameters").joinpath("draws.toml").read_text("utf-8")
    # without the words about the file, which come first, and without the ranges, which come last
    sections = bundled.partition("\n\n")[2].split("\n\n")
    fitted = itertools.takewhile(lambda section: "[ranges]" not in section, sections)
    form = r'(?P<before>"?(?P<name>[^"\s]+)"? = \{ value = )\[.*?\]'
    return re.sub(form, replaced, "\n\n".join(fitted)) + "\n"


def _terms(sets: Array) -> Array:
    """Return 1, x_i and x_i x_j of sets (m, n), about the middle of plausible ranges."""
    x = sets - 0.5
    i, j = np.triu_indices(x.shape[1])
    return np.hstack([np.ones((len(x), 1)), x, x[:, i] * x[:, j]])


def _within(sets: Array) -> Array:
    """Return sets folded back into plausible ranges, 0 to 1."""
    return np.asarray(np.abs((sets + 1.0) % 2.0 - 1.0))
