"""Rank a list of questions by their load factors, and solve only those that may be the best."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hand_models.base import (
    Array,
    CruxError,
    Indices,
    InvalidInputError,
    Pose,
    UnsupportedError,
    wrench_transport,
)
from planner import deadline
from planner.deadline import DeadlineError
from planner.prepare import PreparedStance, prepare_stance
from planner.programs import WRENCH_UNIT
from planner.question import Question
from planner.screening.hand_supports import HandParts, WorldHands
from planner.screening.learning import Learnt, learn
from planner.screening.settings import SCREENING_SETTINGS
from planner.screening.table import ScreeningTable, StanceIndices
from planner.solving import try_stance

__all__ = ["Screened", "screen"]


@dataclass(frozen=True, eq=False)
class Screened:
    """Candidates with upper bounds of their load factors, and the exact ones of the best.

    Attributes
    ----------
    bounds : ndarray, shape (n,)
        Upper bound of each candidate's load factor; −∞ where there is none, or with a fault.
    load_factors : ndarray, shape (n,)
        Load factors of the candidates that were planned; NaN of the others, and where there is
        none.
    utilisations : ndarray, shape (n,)
        Least utilisations of these, verified; NaN of the others.
    order : ndarray of int, shape (n,)
        The candidates, best first: those planned by load factor, then the others by bound.
    faults : dict of int to str
        Why a candidate cannot be planned, by index.
    programs : int
        Number of candidates whose linear programs were solved.
    directions : int
        Number of directions that the bounds rest on.
    """

    bounds: Array
    load_factors: Array
    utilisations: Array
    order: Indices
    faults: dict[int, str]
    programs: int
    directions: int

    @property
    def best(self) -> Indices:
        """The candidates that were planned and have a load factor, best first."""
        return self.order[np.isfinite(self.load_factors[self.order])]

    @property
    def gap(self) -> float:
        """Largest bound of the others less the best load factor; infinite without one."""
        if not len(self.best):
            return float(np.inf)
        others = np.max(self.bounds[np.isnan(self.load_factors)], initial=-np.inf)
        return float(others - self.load_factors[self.best[0]])

    @property
    def proven(self) -> bool:
        """True if no other candidate has a larger load factor, to the solvers' tolerances."""
        slack = 2.0 * SCREENING_SETTINGS.slack
        return len(self.best) > 0 and self.gap <= slack * self.load_factors[self.best[0]]


def screen(questions: Iterable[Question], *, best: int = 1, within: float = 0.0) -> Screened:
    """Find the questions with the largest load factors, and prove that no other has a larger one.

    Bounds follow from supports of the hands, in directions learnt from the candidates that look
    best; programs are solved only of candidates whose bound is not below the best ones known. These
    are planned and verified.

    Parameters
    ----------
    questions : iterable of Question
        Candidates, with fixed wrists on all hands. Only their load factors count: objectives,
        deadlines and extras are left out.
    best : int
        Number of best candidates that are planned.
    within : float
        Part of the best load factor: all candidates that may be within it are planned, too.

    Raises
    ------
    InvalidInputError
        If ``best`` or ``within`` is out of range, or there are no questions.
    DeadlineError
        If the deadline passes first.
    """
    if best < 1:
        raise InvalidInputError(f"must be at least 1, got {best}", field="best")
    if not 0.0 <= within < 1.0:
        raise InvalidInputError(f"must be at least 0 and below 1, got {within:g}", field="within")
    asked = [each.bare() for each in questions]
    if not asked:
        raise InvalidInputError("at least one question is needed", field="questions")
    known, faults = _prepared(asked)
    count = len(asked)
    bounds = np.full(count, -np.inf)
    load_factors, utilisations = np.full((2, count), np.nan)
    places = np.array([i for i in range(count) if i not in faults], dtype=np.intp)
    programs, directions = 0, 0
    if len(places):
        table, stances = known.table(), known.stances(len(asked[places[0]].stance.robot.limbs))
        factors: Array | None = None
        wanted, tried = best, set[int]()
        while True:
            learnt = learn(table, stances, count=wanted, within=within, known=factors)
            table, programs = learnt.table, programs + learnt.solved
            factors, bounds[places] = learnt.factors, _least_bounds(learnt)
            for j in _contenders(learnt, wanted, within):
                if j in tried:
                    continue
                tried.add(j)
                trial = try_stance(prepare_stance(asked[places[j]]))
                factor = trial.load_factor().factor
                if factor is not None:
                    load_factors[places[j]], utilisations[places[j]] = factor, trial.utilisation
            planned = int(np.isfinite(load_factors).sum())
            if planned >= best or wanted >= len(places):
                break
            wanted += best - planned
        directions = len(table.directions)
    bounds = np.fmax(bounds, load_factors)  # equal up to the solvers' tolerances
    rank = np.where(np.isnan(load_factors), bounds, load_factors)
    exact = np.isfinite(load_factors)
    order = np.lexsort((np.arange(count), -rank, ~exact))
    return Screened(bounds, load_factors, utilisations, order, faults, programs, directions)


def _least_bounds(learnt: Learnt) -> Array:
    """Return the least known upper bounds of load factors, shape (N,)."""
    return np.fmin(learnt.bounds, learnt.factors * (1.0 + SCREENING_SETTINGS.slack))


def _contenders(learnt: Learnt, count: int, within: float) -> list[int]:
    """Return the stances that are among the best by their programs, best first."""
    solved = np.flatnonzero(np.isfinite(learnt.factors))
    ranked = solved[np.argsort(-learnt.factors[solved], kind="stable")]
    if not len(ranked):
        return []
    close = learnt.factors[ranked] >= (1.0 - within) * learnt.factors[ranked[0]]
    close[:count] = True
    return [int(j) for j in ranked[close]]


class _Hands:
    """The hands of all candidates, each once, and the stances that they make."""

    def __init__(self) -> None:
        self._parts: list[HandParts] = []
        self._poses: list[Pose] = []
        self._known: dict[tuple[bytes, ...], int] = {}
        self._sets: dict[bytes, HandParts] = {}
        self._members: list[list[int]] = []
        self._wrenches: list[tuple[Pose, Array]] = []

    def add(self, prepared: PreparedStance) -> None:
        """Add a stance; of hands that are known already only the indices are kept."""
        members, stance = [], prepared.question.stance
        for space, hand in zip(prepared.hands.spaces, stance.hands, strict=True):
            arrays = (space.generators, space.origin, space.L, space.l0, space.s, space.H, space.h)
            content = b"".join([each.tobytes() for each in arrays])
            key = content, hand.pose.position.tobytes(), hand.pose.rotation.tobytes()
            if key not in self._known:
                if content not in self._sets:
                    self._sets[content] = HandParts.of(space)
                self._known[key] = len(self._parts)
                self._parts.append(self._sets[content])
                self._poses.append(hand.pose)
            members.append(self._known[key])
        self._members.append(members)
        self._wrenches.append((stance.body, prepared.wrench))

    def table(self) -> ScreeningTable:
        """Return the table of all hands and body wrenches, about the middle of the hands."""
        about = np.mean([pose.position for pose in self._poses], axis=0)
        hands = WorldHands.of(self._parts, self._poses, about)
        carried = [
            wrench_transport(Pose(body.position - about, body.rotation)) @ wrench / WRENCH_UNIT
            for body, wrench in self._wrenches
        ]
        return ScreeningTable.of(hands, np.array(carried))

    def stances(self, limbs: int) -> StanceIndices:
        """Return the stances by indices; hands come first, in any order of limbs."""
        most = max(limbs, max(map(len, self._members)))
        members = np.full((len(self._members), most), -1, dtype=np.intp)
        for row, mine in zip(members, self._members, strict=True):
            row[: len(mine)] = mine
        return StanceIndices(np.arange(len(members)), members)


def _prepared(questions: Sequence[Question]) -> tuple[_Hands, dict[int, str]]:
    """Return the hands of all candidates that can be planned, and what is wrong with the others."""
    known, faults = _Hands(), dict[int, str]()
    for i, question in enumerate(questions):
        deadline.check("all candidates were prepared")
        try:
            prepared = prepare_stance(question)
            if prepared.floating:
                raise UnsupportedError(
                    f"screening requires fixed wrists, got {', '.join(prepared.floating)} with "
                    "others; set wrist to 'fixed'",
                    field="stance.hands",
                )
            if not prepared.needs_hands:
                raise InvalidInputError(
                    "a body wrench of zero has no load factor; give a load", field="body_wrench"
                )
            known.add(prepared)
        except DeadlineError:
            raise
        except CruxError as error:
            faults[i] = str(error)
    return known, faults
