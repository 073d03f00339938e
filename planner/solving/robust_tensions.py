"""Objective of tensions that serve all samples of the parameters at once: `max_robust`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hand_models.base import Array, UnsupportedError
from planner import deadline, programs
from planner.execution import without_margins
from planner.prepare import HandSets, PreparedStance, Sets, settled_as_drawn, with_drawn_hands
from planner.programs import (
    CAP_SLACK,
    Outcome,
    Robust,
    SampleData,
    StanceData,
    convex_bound,
    feedback_price,
    parted,
    tie_weight,
)
from planner.question import drawn_hands
from planner.solving.objective import MAX_MARGIN, CappedObjective

__all__ = ["MaxRobust"]


@dataclass(frozen=True, eq=False)
class MaxRobust(CappedObjective):
    """Least mean utilisation over samples of the parameters, with tensions that serve all of them.

    The function of the loads is the mean of `programs.sample_value` over the samples, plus a small
    term that makes the plan unique; the program is `planner.programs.Robust`.

    Attributes
    ----------
    own : SampleData or None
        The question's own hands; None before `within`.
    samples : tuple of SampleData
        Those samples in which the body can be balanced.
    """

    name = "max_robust"
    words = "mean utilisation over samples"
    late = "robust_tensions"
    dispensable = True
    own: SampleData | None = None
    samples: tuple[SampleData, ...] = ()

    def within(
        self, prepared: PreparedStance, sets: Sets, loads: Sequence[Array]
    ) -> MaxRobust | None:
        """Return the objective with the hands of all samples, closed on the holds of a stance.

        Parameters
        ----------
        prepared : PreparedStance

        Raises
        ------
        UnsupportedError
            If no sample has a balance.
        """
        question = prepared.question
        if float(programs.used(sets.data, loads).max()) > question.limits.utilisation + CAP_SLACK:
            return None
        bare, samples = without_margins(prepared), []
        limbs = tuple(sorted(hand.limb for hand in question.stance.hands))
        for drawn in drawn_hands(question.stance.robot.hand, question.draws, limbs=limbs):
            there = with_drawn_hands(bare, settled_as_drawn(bare, drawn))
            if deadline.expired():
                # the program will not be solved either
                return self
            if there is not None:
                sample = _sample_of(there.hands)
                value, _ = programs.sample_value(
                    sample, np.zeros(len(sample.tensions)), feedback_price()
                )
                samples += [sample] if np.isfinite(value) else []
        if not samples:
            raise UnsupportedError(
                f"{self.name} requires samples in which the hands balance the body, and there is "
                f"none; valid is {MAX_MARGIN.name}",
                field="objective",
            )
        return MaxRobust(_sample_of(prepared.hands), tuple(samples))

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Solve `planner.programs.Robust`; reactions are those of least utilisation."""
        if self.own is None:
            return Outcome(False, programs.OUT_OF_TIME, 0, math.nan)
        own = self.own._replace(data=data)
        outcome = Robust(own, self.samples, feedback_price(), cap).solve()
        if not outcome.solved:
            return outcome
        held = np.full(len(data.rows.unit), np.nan)
        held[own.tensions] = np.concatenate(outcome.loads)[own.tensions]
        again = programs.kept(data, parted(held, [len(hand.unit) for hand in data.hands]))
        better = again.solved and again.value <= cap + CAP_SLACK
        return replace(outcome, loads=again.loads) if better else outcome

    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return the mean over the samples, plus the small term."""
        return self._measure(data, loads)[0]

    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return the gradient of `value` in the scaled loads of all hands, shape (M,)."""
        return self._measure(data, loads)[1]

    def bound(self, data: StanceData, outcome: Outcome, cap: float) -> float:
        """Return a lower bound of the value of every plan, proven by multipliers."""
        return convex_bound(data, outcome, *self._measure(data, outcome.loads), cap)

    def _measure(self, data: StanceData, loads: Sequence[Array]) -> tuple[float, Array]:
        """Return `value` and `slopes`."""
        assert self.own is not None
        z, places = np.concatenate(loads) / data.rows.unit, self.own.tensions
        small = tie_weight(len(data.hands)) * data.rows.tie * z
        found = [programs.sample_value(each, z[places], feedback_price()) for each in self.samples]
        values, gradients = zip(*found, strict=True)
        slopes = 2.0 * small
        slopes[places] += np.mean(gradients, axis=0)
        return float(np.mean(values) + small @ z), slopes


def _sample_of(hands: HandSets) -> SampleData:
    """Return the rows of hands with fixed wrists, and the places of their tensions."""
    columns = [name for space in hands.spaces for name in space.columns]
    places = np.flatnonzero([name.endswith("/tension") for name in columns])
    return SampleData(hands.data, places)
