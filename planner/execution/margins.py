"""Margins of hard rows that a plan keeps as far as the cap on its utilisation allows.

The share of all margins that a plan keeps, from 0 (without) to 1, is the largest with which there
is a plan within the cap, and within a tenth more than the least utilisation without margins. Of a
stance that is overloaded without any, it is the largest that costs no utilisation. With fixed
wrists it is the optimum of a linear program with the body wrench and that bound in its right-hand
side, so it changes continuously with the loads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeVar

import numpy as np

from hand_models.base import root_between
from hand_models.parameters import bundled_table
from planner import deadline, programs
from planner.deadline import DeadlineError
from planner.prepare import PreparedStance
from planner.programs import CAP_SLACK
from planner.question import Limits
from planner.result import Finding

__all__ = [
    "MARGIN_SETTINGS",
    "KeptMargins",
    "MarginSettings",
    "kept_margins",
    "margin_not_had",
    "without_margins",
]

AnswerT = TypeVar("AnswerT")


@dataclass(frozen=True, slots=True)
class MarginSettings:
    """Settings of the search for the share of the margins that can be kept."""

    inside: float = 1e-6
    """Share by which a plan stays inside the largest: rounding must not empty its set."""
    accuracy: float = 0.01  # of the share with wrists that move, or less if that is more than
    least: float = 0.02  # of the largest margin [N]
    found: float = 1e-3
    """Part of the utilisation to which the local search for moving wrists finds the least."""
    none: float = 10.0
    """Utilisation beyond the cap that stands for no plan: finite, so that it can be bracketed."""


MARGIN_SETTINGS: Final = MarginSettings()


class KeptMargins(NamedTuple):
    """Share of margins that a plan keeps, of those that it need not keep.

    Attributes
    ----------
    asked : mapping of str to float
        The margins by name [N].
    share : float
        From 0 (the plan goes without) to 1.
    least, most : float
        Least utilisation without margins, and the largest that margins may make of it.
    """

    asked: Mapping[str, float]
    share: float
    least: float
    most: float

    def findings(self, cap: float) -> Iterator[Finding]:
        """Yield a finding unless all is kept; ``cap`` is the question's, on the utilisation."""
        if self.share == 1.0 or not self.asked:
            return
        kept, more = f"only {100.0 * self.share:{'.0f' if self.share >= 0.1 else '.2g'}} %", "more"
        if self.share * max(self.asked.values()) < MARGIN_SETTINGS.least:
            kept, more = "nothing", "any of it"
        end = f"take the utilisation beyond {self.most:.4g}, where {self.least:.4g} is the least"
        if self.least > cap + CAP_SLACK:
            end = "add to the overload"
        message = f"of a {_said(self.asked)} the plan keeps {kept}: {more} would {end}"
        yield Finding("margin_reduced", "limits.margins", message, self.share, "1")


def margin_not_had(asked: Mapping[str, float], cap: float, used: float) -> Finding:
    """Return the finding that there is a plan within the cap without the margins, not with them.

    Parameters
    ----------
    asked : mapping of str to float
        The margins by name [N].
    cap, used : float
        Cap on the utilisation, and the least utilisation without margins.
    """
    message = (
        f"with a {_said(asked)} there is no plan within the utilisation of {cap:g}; without, it is "
        f"{used:.4g}: lower the margin, or go without"
    )
    return Finding("margin_not_had", f"limits.{next(iter(asked))}", message, used, "1")


def _said(margins: Mapping[str, float]) -> str:
    return " and ".join(f"{name} of {value:g} N" for name, value in margins.items())


def without_margins(prepared: PreparedStance) -> PreparedStance:
    """Return a stance whose hard rows have no margin: a margin is for plans, not for what happens.

    Parameters
    ----------
    prepared : PreparedStance
    """
    limits = prepared.question.limits
    return prepared.with_margins(limits.with_share(0.0)) if limits.asked_margins else prepared


def kept_margins(
    free: PreparedStance,
    asked: Limits,
    least: float,
    answered: Callable[[float], tuple[float, AnswerT]],
) -> tuple[KeptMargins, AnswerT]:
    """Return the largest share of margins that a plan can keep, and the answer that keeps it.

    Parameters
    ----------
    free : PreparedStance
        The stance without margins.
    asked : Limits
        Limits with all of the margins.
    least : float
        Least utilisation of the stance without margins.
    answered : callable
        Returns the least utilisation with a share, infinite without a plan, and the answer.

    Raises
    ------
    DeadlineError
        If the deadline passes before an answer is found.
    """
    moving = free.hands.floating
    slack = MARGIN_SETTINGS.found * abs(least) if moving else 0.5 * CAP_SLACK
    most = min(asked.utilisation, (1.0 + _cost()) * abs(least))
    budget, kept = max(most, least + slack), dict[float, AnswerT]()
    margins, settings = asked.asked_margins, MARGIN_SETTINGS
    step = min([settings.accuracy, *(settings.least / each for each in margins.values())])

    def beyond(share: float) -> float:
        """Return by how much the plan that keeps a share exceeds the budget."""
        deadline.check("a plan was found")
        used, answer = answered(share)
        if share == 0.0 or used <= budget + CAP_SLACK:
            kept[share] = answer
        return min(used - budget, MARGIN_SETTINGS.none)

    try:
        if moving:
            if (without := beyond(0.0)) < 0.0 and (whole := beyond(1.0)) > CAP_SLACK:
                root_between(beyond, (0.0, 1.0), (without, whole), step)
        else:
            share = _share_of_fixed(free, asked, budget)
            # each share once: the first may be zero
            for each in dict.fromkeys((share, max(share - step, 0.0), 0.0)):
                if beyond(each) <= CAP_SLACK:
                    break
    except DeadlineError:
        if not kept:
            raise
    share = max(kept)
    return KeptMargins(margins, share, least, budget), kept[share]


def _cost() -> float:
    """Return the part of the least utilisation that margins may cost."""
    table = bundled_table("plans.toml", "planner.parameters")
    return table.positive("margins", "cost")


def _share_of_fixed(free: PreparedStance, asked: Limits, budget: float) -> float:
    """Return the largest share of margins with which fixed wrists have a plan within a budget."""
    data, whole = free.hands.data, free.with_margins(asked).hands.data
    hands, K = [], []
    for own, kept in zip(data.hands, whole.hands, strict=True):
        # hard rows H z + (h - h of all margins) t <= h, and t <= 1, as limits at the budget
        limits, last = np.vstack([own.L, own.H, np.zeros((1, len(own.unit)))]), budget - 1.0
        l0 = np.concatenate([own.l0, budget - own.h, [last]])
        hands.append(own._replace(L=limits, l0=l0, H=own.H[:0], h=own.h[:0]))
        K.append(np.concatenate([np.zeros(len(own.l0)), own.h - kept.h, [1.0]])[:, None])
    rows = programs.StanceData.of(tuple(hands), data.wrench)
    goal, still = np.ones(1), np.zeros((len(data.wrench), 1))
    share = float(programs.reach(rows, goal, still, budget, K).t[0])
    if not share > MARGIN_SETTINGS.inside:
        return 0.0
    return 1.0 if share >= 1.0 - MARGIN_SETTINGS.inside else share - MARGIN_SETTINGS.inside
