"""Survival of a climb: every stage at its plan, while a hand that stays keeps its strengths.

A hand has the strengths of its tiles from the stage in which it is placed to the stage in which it
lifts; on a new hold they are drawn anew. The factor of the rock is one for the whole climb. Every
stage begins with all tiles on the rock, also with those that slipped in the stage before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.tile import StrengthScatter, Surface, TileStrengths
from planner.prepare import PreparedStance, prepare_stance
from planner.processes import by_index, cores
from planner.question import SurvivalSettings
from planner.result import Plan, Survival, SurvivalShare
from planner.route.climb import Phase, RouteResult, RouteStage
from planner.simulation import Draws, draw_slips, hand_of_units

__all__ = ["RouteShare", "RouteSurvival", "StageSurvival", "find_route_survival"]


class StageSurvival(Struct, frozen=True, kw_only=True):
    """Survival of one stage of a climb.

    Attributes
    ----------
    index, move : int
    phase : {'start', 'shift', 'lift', 'place'}
    limb : str or None
    status : str
        Of the stage's plan.
    utilisation : float or None
    survival : Survival or None
        None of a stage without a plan.
    """

    index: int
    move: int
    phase: Phase
    limb: str | None
    status: str
    utilisation: float | None
    survival: Survival | None


class RouteShare(Struct, frozen=True, kw_only=True):
    """Probability that all hands hold in every stage of a climb.

    Attributes
    ----------
    all_stages : SurvivalShare
        Share of draws that hold in every stage. A hand that stays keeps its strengths.
    least : float
        Least of the stages' probabilities; the climb's cannot be larger.
    product : float
        Product of the stages' probabilities: as if every stage drew all strengths anew.
    """

    all_stages: SurvivalShare
    least: float
    product: float


class RouteSurvival(Struct, frozen=True, kw_only=True):
    """Survival of a climb.

    Attributes
    ----------
    route : str
        Name of the climb.
    status : str
        Worst status of all stages.
    stages : list of StageSurvival
        In climbing order.
    worst : int
        Index of the stage that most probably loses a hand, or has no plan.
    no_slip : float or None
        Probability that no tile slips in any stage, by the formula; None if a stage has no plan.
    strength_90, strength_99 : float or None
        Factor of all mean strengths at which ``no_slip`` is 0.9, and 0.99.
    holds, replanned : RouteShare or None
        All hands hold in every stage, tensions fixed, and with new set-points after each slip; None
        if a stage has no plan, or was not simulated.
    reason : str or None
        Why a climb as a whole has no probability.
    """

    route: str
    status: str
    stages: list[StageSurvival]
    worst: int
    no_slip: float | None = None
    strength_90: float | None = None
    strength_99: float | None = None
    holds: RouteShare | None = None
    replanned: RouteShare | None = None
    reason: str | None = None


class _Ended(NamedTuple):
    """Draws of a stage, with surface and use of the units of each placed hand, by its field."""

    draws: Draws
    used: dict[str, tuple[Surface, Array]]


def find_route_survival(
    result: RouteResult,
    settings: SurvivalSettings | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RouteSurvival:
    """Return the survival of a climb, each stage at its plan.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages.
    settings : SurvivalSettings, optional
        Draws of strengths in every stage; its defaults by default.
    workers : int, optional
        Number of processes; by default one for each core.
    progress : callable, optional
        Called after each stage with (number of stages simulated, number of stages).
    """
    settings = settings or SurvivalSettings()
    planned = [i for i, p in enumerate(result.plans) if isinstance(p, Plan) and p.hands is not None]
    placed = sorted({at for stage in result.stages for at in _placed(stage)})
    numbers = {at: i for i, at in enumerate(placed, start=1)}
    make = partial(_drawing, [_Stage.of(result, i) for i in planned], numbers, settings)
    found: dict[int, _Ended] = {}
    count = cores() if workers is None else workers
    for i, ended in by_index(make, make(), len(planned), min(count, len(planned))):
        found[planned[i]] = ended
        if progress is not None:
            progress(len(found), len(planned))
    stages = [
        StageSurvival(
            index=stage.index,
            move=stage.move,
            phase=stage.phase,
            limb=stage.limb,
            status=answer.status,
            utilisation=answer.utilisation,
            survival=found[i].draws.survival if i in found else None,
        )
        for i, (stage, answer) in enumerate(zip(result.stages, result.plans, strict=True))
    ]
    whole = RouteSurvival(
        route=result.route.name, status=result.status, stages=stages, worst=_worst(stages)
    )
    without = [i for i in range(len(stages)) if i not in found]
    if without:
        more = "" if len(without) == 1 else f", and {len(without) - 1} more have none"
        return replace(whole, reason=f"stage {without[0]} has no plan{more}")
    return _of_all(whole, [found[i] for i in range(len(stages))], settings)


class _Stage(NamedTuple):
    """A stage and its plan, for another process."""

    stage: RouteStage
    plan: Plan

    @classmethod
    def of(cls, result: RouteResult, index: int) -> _Stage:
        answer = result.plans[index]
        assert isinstance(answer, Plan)
        return cls(result.stages[index], answer)


def _placed(stage: RouteStage) -> list[str]:
    """Return the field of the route that has placed each hand of a stage."""
    return [stage.paths[f"hands[{i}]"] for i in range(len(stage.question.stance.hands))]


def _drawing(
    todo: Sequence[_Stage], numbers: Mapping[str, int], settings: SurvivalSettings
) -> Callable[[int], _Ended]:
    """Return the function that simulates a stage by its index; called in each process."""
    return lambda index: _draw(*todo[index], numbers, settings)


def _draw(
    stage: RouteStage, plan: Plan, numbers: Mapping[str, int], settings: SurvivalSettings
) -> _Ended:
    assert plan.hands is not None
    prepared, placed = prepare_stance(stage.question), _placed(stage)
    strengths = _strengths(prepared, [numbers[at] for at in placed], settings)
    draws = draw_slips(prepared, plan.hands, settings, strengths)
    used = {
        at: (hand.surface, draws.used[hand_of_units(prepared) == h])
        for h, (at, hand) in enumerate(zip(placed, prepared.batch.hands, strict=True))
    }
    return _Ended(draws, used)


def _strengths(
    prepared: PreparedStance, numbers: Sequence[int], settings: SurvivalSettings
) -> Array:
    """Return strengths, (draws, T + H): a hand of the same number has the same in every stage."""
    scatter = StrengthScatter.bundled(settings.hold_scatter, settings.rock_scatter)
    of_hand, alone = hand_of_units(prepared), StrengthScatter(scatter.hold, 0.0)
    found = np.empty((settings.draws, len(of_hand)))
    for h, (hand, number) in enumerate(zip(prepared.batch.hands, numbers, strict=True)):
        own = of_hand == h
        law = TileStrengths.of([hand.surface], np.zeros(int(own.sum()), dtype=np.intp), alone)
        found[:, own] = law.sample(settings.draws, [settings.seed, number], settings.strength)
    return found * scatter.sample_rock(settings.draws, [settings.seed, 0])[:, None]


def _of_all(
    whole: RouteSurvival, ended: Sequence[_Ended], settings: SurvivalSettings
) -> RouteSurvival:
    """Return the survival with the probabilities of all stages together."""
    most: dict[str, tuple[Surface, Array]] = {}
    for each in ended:
        for at, (surface, used) in each.used.items():
            before = most[at][1] if at in most else used
            most[at] = surface, np.maximum(before, used)
    sizes = [len(used) for _, used in most.values()]
    law = TileStrengths.of(
        [surface for surface, _ in most.values()],
        np.repeat(np.arange(len(sizes)), sizes),
        StrengthScatter.bundled(settings.hold_scatter, settings.rock_scatter),
    )
    used = np.concatenate([used for _, used in most.values()])
    reasons = [each.draws.survival.reason for each in ended]
    first = next((i for i, reason in enumerate(reasons) if reason is not None), None)
    return replace(
        whole,
        no_slip=law.no_slip(used, settings.strength),
        strength_90=law.factor_for(used, 0.9),
        strength_99=law.factor_for(used, 0.99),
        holds=_share([each.draws.held for each in ended]),
        replanned=_share([each.draws.replanned for each in ended]),
        reason=None if first is None else f"stage {first}: {reasons[first]}",
    )


def _share(held: Sequence[NDArray[np.bool_]]) -> RouteShare | None:
    """Return the share of draws that hold in all stages; None if a stage has no draws."""
    # a deadline can leave a stage fewer draws than the others
    draws = min(len(each) for each in held)
    if not draws:
        return None
    held = [each[:draws] for each in held]
    together = np.logical_and.reduce(held)
    shares = [float(each.mean()) for each in held]
    return RouteShare(
        all_stages=SurvivalShare.of(int(together.sum()), len(together)),
        least=min(shares),
        product=math.prod(shares),
    )


def _worst(stages: Sequence[StageSurvival]) -> int:
    """Return the index of the stage that most probably loses a hand; first those without a plan."""
    found = [stage.survival for stage in stages]

    def key(i: int) -> tuple[float, ...]:
        here = found[i]
        if here is None:
            return (-1.0,)
        shares = [
            (here.replanned, all(each is None or each.replanned for each in found)),
            (here.holds, all(each is None or each.holds for each in found)),
        ]
        known = [share.probability for share, all_have in shares if share and all_have]
        return (*known, here.no_slip)

    return min(range(len(stages)), key=key)
