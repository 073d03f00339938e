"""From a question to a verified plan: settle the hands, solve, read, check, explain."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from hand_models.compliant_hand import CompliantHand
from hand_models.errors import InvalidInputError, UnsupportedError
from hand_models.fixed_wrist import wrench_space
from hand_models.floating_wrist import FloatingWrist, PalmMode
from hand_models.frames import Array, wrench_transport
from hand_models.hand import SettledHand
from hand_models.row_layout import PALM_PRESSING, PALM_SHEAR
from hand_models.wrench_space import WrenchSpace
from planner import program
from planner.budget import Budget
from planner.certificate import certify, limit_name
from planner.continuation import PROGRAMS, LargestFactor, least_use, most_load
from planner.explain import (
    LEAST_FACTOR,
    NO_FACTOR,
    UNPROVEN,
    limit_sentence,
    shortfall_sentence,
    warnings,
)
from planner.floating import Settled
from planner.floating_warnings import far_wrists, idle_preloads, strained_preloads
from planner.hand_sets import Hands, widest_at_rest
from planner.plan import (
    Certificate,
    HandPlan,
    LimitName,
    Plan,
    Price,
    SolverInfo,
    Status,
    Times,
    WristPlan,
)
from planner.program import LOAD_UNIT, SLACK, SOLVER, WRENCH_UNIT, Outcome, StanceData
from planner.reading import read_floating_hand, read_hand
from planner.stance import HandOnHold, Question, Stance
from planner.verify import problems

__all__ = ["RestingHand", "floating_wrist", "hand_space", "plan", "resting_hand"]

OPTIMAL: Final = 1e-5
"""How far, relatively, the utilisation may be above its proven lower bound."""

BALANCED: Final = 1e-7
"""Distance to the nearest body wrench, relative, below which rounding alone is to blame."""

BINDING: Final = 1e-6
"""Multipliers below this do not count as binding."""

ALIKE: Final = 5
"""Decimals of multipliers by which limits are ranked; where these are alike, rows' order counts."""

UNITS: Final = {"motor_torque": "N·m", "motor_current": "A"}
"""Of limits that are not in newtons."""


def settle(hand: HandOnHold, stance: Stance) -> SettledHand:
    """Close one hand of a stance on its hold."""
    return stance.robot.hand.settle(hand.hold, hand.surface, hand.grasp, hand.placed_hold())


def _settle_at(stance: Stance, index: int) -> SettledHand:
    """Close the hand of that index; an error's field is relative to the question."""
    try:
        return settle(stance.hands[index], stance)
    except InvalidInputError as error:
        raise error.within(f"stance.hands[{index}]") from None


def _wrist_at(
    stance: Stance, index: int, settled: SettledHand, tension_limit: float | None = None
) -> FloatingWrist | None:
    """Return how the hand of that index gives way; None if its wrist is fixed."""
    hand = stance.hands[index]
    if hand.wrist == "fixed":
        return None
    try:
        return FloatingWrist(CompliantHand(settled, hand.tendon_preload), tension_limit)
    except InvalidInputError as error:
        if isinstance(error, UnsupportedError):
            error.field = "wrist"
        raise error.within(f"stance.hands[{index}]") from None


def hand_space(stance: Stance, limb: str) -> tuple[SettledHand, WrenchSpace]:
    """Return one hand of a stance on its hold, and what it can carry; see `resting_hand`."""
    hand = resting_hand(stance, limb)
    return hand.settled, hand.space


class RestingHand(NamedTuple):
    """One hand of a stance on its hold, and what it can carry.

    Attributes
    ----------
    settled : SettledHand
    space : WrenchSpace
        Of a floating hand the widest of its sets linearised at rest, one for each palm mode.
    palm : PalmMode or None
        The mode of that set; None for a fixed wrist.
    error : float
        How far it is off at most where it reaches farthest along ± each axis: forces, and moments
        over 0.1 m [N].
    """

    settled: SettledHand
    space: WrenchSpace
    palm: PalmMode | None = None
    error: float = 0.0


def resting_hand(stance: Stance, limb: str) -> RestingHand:
    """Return one hand of a stance on its hold, and what it can carry.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, or the hold cannot be where it is.
    """
    settled, wrist = _hand_at(stance, limb)
    if wrist is None:
        return RestingHand(settled, wrench_space(settled))
    palm, space, error = widest_at_rest(wrist)
    return RestingHand(settled, space, palm, error)


def floating_wrist(stance: Stance, limb: str) -> FloatingWrist:
    """Return how one hand of a stance gives way.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, its wrist is fixed, or the hold cannot be where it is.
    """
    _, wrist = _hand_at(stance, limb)
    if wrist is None:
        raise InvalidInputError(f"the wrist of {limb} is fixed; floating is needed", field="limb")
    return wrist


def _hand_at(stance: Stance, limb: str) -> tuple[SettledHand, FloatingWrist | None]:
    for i, hand in enumerate(stance.hands):
        if hand.limb == limb:
            settled = _settle_at(stance, i)
            return settled, _wrist_at(stance, i, settled)
    limbs = ", ".join(hand.limb for hand in stance.hands)
    raise InvalidInputError(f"no hand {limb!r} in this stance; it has {limbs}", field="limb")


def plan(question: Question) -> Plan:
    """Answer a question: the plan with the least utilisation, verified, or why there is none.

    Parameters
    ----------
    question : Question

    Returns
    -------
    Plan

    Raises
    ------
    InvalidInputError
        If the question cannot be understood; its ``field`` is relative to the question.
    """
    start = time.perf_counter()
    stance = question.stance
    try:
        wrench = question.needed_wrench()
    except InvalidInputError as error:
        raise error.within("load") from None
    settled = [_settle_at(stance, i) for i in range(len(stance.hands))]
    cap = question.limits.tendon_tension
    wrists = [_wrist_at(stance, i, hand, cap) for i, hand in enumerate(settled)]
    spaces = [
        wrench_space(hand, cap) if wrist is None else wrist.linearised()
        for hand, wrist in zip(settled, wrists, strict=True)
    ]
    body = stance.body.inverse()
    hands = Hands(
        spaces=tuple(spaces),
        wrists=tuple(wrists),
        transports=tuple(wrench_transport(body @ hand.pose) for hand in stance.hands),
        reaches=tuple(
            _reach(space) if wrist is None else None
            for space, wrist in zip(spaces, wrists, strict=True)
        ),
        wrench=wrench / WRENCH_UNIT,
    )
    modelled = time.perf_counter()
    answer = _Answer(question, settled, hands, wrench)
    answer.solve()
    solved = time.perf_counter()
    return answer.read(Times(modelled - start, solved - modelled, 0.0), start)


def _reach(space: WrenchSpace) -> Array:
    """Return what each column's load is measured by in the tie-break [N].

    Its own capacity where it has one (tendons, the palm); `LOAD_UNIT` for lateral reactions.
    """
    reach = np.full(len(space.columns), LOAD_UNIT)
    for coefficients, row, capacity in zip(space.L, space.rows, space.s, strict=False):
        if row.limit in ("tendon_tension", PALM_SHEAR, PALM_PRESSING):
            reach[np.flatnonzero(coefficients)[0]] = capacity
    return reach


class _Answer:
    """One question on its way from data to plan."""

    def __init__(
        self,
        question: Question,
        settled: Sequence[SettledHand],
        hands: Hands,
        wrench: Array,
    ) -> None:
        self.question = question
        self.settled = settled
        self.parts = hands
        self.spaces, self.data = hands.sets(hands.at_rest(hands.idle))
        self.wrench = wrench
        limbs = [hand.limb for hand in question.stance.hands]
        self.idle_preloads = idle_preloads(limbs, settled, hands.wrists)
        self.search: Settled | None = None
        self.budget = Budget(PROGRAMS)
        self.known_factor: LargestFactor | None = None
        self.outcome: Outcome
        self.loads: tuple[Array, ...] = ()
        self.hands: tuple[HandPlan, ...] = ()
        self.utilisation = math.inf
        self.wrong: list[str] = []
        self.certificate: Certificate | None = None
        self.load_factor: float | None = None
        self.least_factor = False
        self.unbounded = False

    # Solving ------------------------------------------------------------------------------------

    def solve(self) -> None:
        """Find the loads, or the certificate that there are none."""
        if self.parts.floating:
            self._settle_wrists()
        else:
            self.outcome = program.margin(self.data)
            self._settle_tie()
        if not self.outcome.solved or self.wrong:
            self._look_again()
        if "load_factor" in self.question.want:
            self._find_load_factor()

    def _settle_wrists(self) -> None:
        """Find where floating wrists go, and take the plan there."""
        self.search, self.known_factor = least_use(self.parts, self.budget)
        self.outcome = self.search.outcome
        if self.search.exact:
            self.spaces, self.data = self.search.sets
            self._take(self.search.point.loads)
        else:
            self.spaces, self.data = self.parts.sets(self.search.point)

    def _settle_tie(self) -> None:
        """Take the plan of least effort among those of least utilisation."""
        if not self.outcome.solved:
            return
        cap = self.outcome.value + SLACK * max(1.0, abs(self.outcome.value))
        tidy = program.effort(self.data, cap)
        if tidy.solved:
            self._take(tidy.loads)
        if not tidy.solved or self.wrong:
            self._take(self.outcome.loads)

    def _take(self, loads: tuple[Array, ...]) -> None:
        """Read these loads, and check them."""
        self.loads = loads
        self.hands = tuple(self._read_hand(i, y) for i, y in enumerate(loads))
        self.utilisation = max(hand.utilisation for hand in self.hands)
        self.wrong = problems(
            self.question, self.settled, self.hands, self.utilisation, self.wrench
        )

    def _read_hand(self, index: int, y: Array) -> HandPlan:
        limb, settled = self.question.stance.hands[index].limb, self.settled[index]
        space, wrist, search = self.spaces[index], self.parts.wrists[index], self.search
        if wrist is None or search is None:
            return read_hand(limb, settled, space, y)
        pose = WristPlan(y, search.point.palms[index] or "off", search.rounds, search.error)
        return read_floating_hand(limb, settled, wrist.hand, space, pose)

    def _look_again(self) -> None:
        """Tell no balance at all from a solver that failed."""
        nearest = program.nearest(self.data)
        if not nearest.solved:
            return
        if nearest.value > BALANCED * max(1.0, float(np.linalg.norm(self.data.wrench))):
            self.certificate = certify(
                self.data,
                [place.limb for place in self.question.stance.hands],
                self.spaces,
                nearest,
            )
            if self.certificate is not None:
                self.outcome = replace(self.outcome, solved=False)
        elif not self.outcome.solved and not self.parts.floating:
            # rounding put the wrench a hair outside: plan for the nearest that can be had
            inside = program.body_wrench(self.data, nearest.loads)
            self.outcome = program.margin(StanceData(self.data.hands, inside))
            self._settle_tie()

    def _find_load_factor(self) -> None:
        if not np.abs(self.data.wrench).max() > 1e-9:
            # nothing is asked of the hands: any multiple of it can be held, or none
            self.unbounded = self.outcome.solved and self.outcome.value <= 1.0 + SLACK
            return
        if self.search is not None:
            most = most_load(self.parts, self.search, self.known_factor, self.budget)
            if most is not None:
                self.load_factor, self.least_factor = most.factor, not most.sure
            return
        result = program.load_factor(self.data)
        if result.solved:
            scaled = StanceData(self.data.hands, self.data.wrench * result.value)
            error = program.body_wrench(scaled, result.loads) - scaled.wrench
            used = max(
                float(np.max(hand.L @ (y / hand.unit) + hand.l0, initial=0.0))
                for hand, y in zip(self.data.hands, result.loads, strict=True)
            )
            if np.abs(error).max() <= SLACK and used <= 1.0 + SLACK:
                self.load_factor = max(result.value, 0.0)

    # Reading ------------------------------------------------------------------------------------

    def read(self, times: Times, start: float) -> Plan:
        """Return the plan, verified."""
        hands: tuple[HandPlan, ...] | None = None
        utilisation: float | None = None
        limiting: LimitName | None = None
        residual: Array | None = None
        prices: tuple[Price, ...] | None = None
        verified = False
        status: Status = "failed"
        if self.outcome.solved:
            hands, utilisation = self.hands, self.utilisation
            wrong = self.wrong or self._not_least(utilisation)
            if wrong:
                reason = f"the solver's plan does not pass the checks: {wrong[0]}"
                hands = utilisation = None
            else:
                verified = True
                cap = self.question.limits.utilisation
                status = "optimal" if utilisation <= cap + SLACK else "overloaded"
                residual = self._residual(hands)
                dear = self._prices()
                limiting, reason = self._explain(hands, utilisation, status, dear)
                prices = dear if "prices" in self.question.want else None
        elif self.certificate is not None:
            status = "infeasible"
            verified = True
            touching = any(h.holding.any() or h.palm.engaged for h in self.settled)
            reason = shortfall_sentence(self.certificate, touching)
            if self.parts.floating:
                reason += "; floating hands as they give way where the search for a plan ended"
        elif self.search is not None:
            reason = "no pose of the floating wrists was found that balances the body"
            if self.idle_preloads:
                reason += f"; {self.idle_preloads[0]}"
        else:
            reason = f"the solver gave no usable answer ({self.outcome.status})"
        return Plan(
            status=status,
            body_wrench=self.wrench,
            utilisation=utilisation,
            load_factor=self.load_factor,
            load_factor_unbounded=self.unbounded,
            limiting=limiting,
            hands=hands,
            prices=prices,
            certificate=self.certificate,
            residual=residual,
            verified=verified,
            reason=reason,
            warnings=self._warnings(),
            solver=SolverInfo(SOLVER, self.outcome.status, self.outcome.iterations),
            time=Times(times.model, times.solve, time.perf_counter() - start),
        )

    def _warnings(self) -> tuple[str, ...]:
        found = warnings(self.question.stance, self.settled)
        limbs = [hand.limb for hand in self.question.stance.hands]
        cap = self.question.limits.tendon_tension
        found += (*self.idle_preloads, *strained_preloads(limbs, self.parts.wrists, cap))
        if self.outcome.solved:
            found += tuple(far_wrists(self.hands))
        if self.search is not None and self.search.found == "unproven":
            found += (UNPROVEN,)
        asked = "load_factor" in self.question.want and not self.unbounded
        if self.search is not None and asked and self.load_factor is None:
            found += (NO_FACTOR,)
        if self.least_factor:
            found += (LEAST_FACTOR,)
        return found

    def _not_least(self, utilisation: float) -> list[str]:
        """Return what is wrong if the multipliers do not prove the utilisation the least.

        With floating hands, the least of their sets about the plan.
        """
        if self.search is not None and self.search.found == "unproven":
            return []
        bound = program.least_bound(self.data, self.outcome)
        if utilisation - bound <= OPTIMAL * max(1.0, utilisation):
            return []
        return [f"utilisation {utilisation:.6g} is only proven to be above {bound:.6g}"]

    def _residual(self, hands: Sequence[HandPlan]) -> Array:
        body = self.question.stance.body.inverse()
        total = -self.wrench
        for place, hand in zip(self.question.stance.hands, hands, strict=True):
            total = total - wrench_transport(body @ place.pose) @ hand.wrench
        return np.asarray(total)

    def _explain(
        self,
        hands: Sequence[HandPlan],
        utilisation: float,
        status: Status,
        dear: Sequence[Price],
    ) -> tuple[LimitName | None, str]:
        """Return the limit with the largest utilisation, and a sentence about it.

        Of limits that tie, the dearest: the others only follow it.
        """
        close = utilisation - 2.0 * SLACK * max(1.0, utilisation)
        rank_of = {price.name: len(dear) - i for i, price in enumerate(dear)}
        best: tuple[bool, int, float] | None = None
        limiting: LimitName | None = None
        sentence = "nothing limits this stance"
        held = utilisation <= 1.0 + SLACK
        for hand, space, y in zip(hands, self.spaces, self.loads, strict=True):
            for row, used in enumerate(space.utilisations(y)):
                name = limit_name(hand.limb, space.rows[row])
                rank = (bool(used >= close), rank_of.get(name, 0), float(used))
                if best is None or rank > best:
                    best, limiting = rank, name
                    load, capacity = float(used * space.s[row]), float(space.s[row])
                    sentence = limit_sentence(name, load, capacity, hand, held=held)
        if status == "overloaded" and held:
            cap = self.question.limits.utilisation
            sentence += f"; that is beyond the utilisation of {cap:g} that was asked for"
        return limiting, sentence

    def _prices(self) -> tuple[Price, ...]:
        """Return the price of each limit that binds; rows of one name are one limit.

        The dearest first: of which one per cent more would take most off the utilisation, so that
        newtons compare with amperes.
        """
        prices: dict[LimitName, float] = {}
        worth: dict[LimitName, float] = {}
        for place, space, duals in zip(
            self.question.stance.hands, self.spaces, self.outcome.limit_duals, strict=True
        ):
            for row, multiplier, capacity in zip(space.rows, duals, space.s, strict=False):
                if multiplier > BINDING:
                    name = limit_name(place.limb, row)
                    price = float(multiplier * self.outcome.value / capacity)
                    prices[name] = prices.get(name, 0.0) + price
                    worth[name] = worth.get(name, 0.0) + float(multiplier)
        return tuple(
            Price(name, prices[name], UNITS.get(name.limit, "N"))
            for name in sorted(worth, key=lambda name: -round(worth[name], ALIKE))
        )
