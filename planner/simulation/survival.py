"""Survival of a plan: the probability that no tile slips, and that all hands hold if some do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from msgspec import structs

from hand_models.base import Array, Indices
from hand_models.parameters import bundled_table
from planner import deadline
from planner.prepare import PreparedStance, prepare_stance
from planner.processes import by_index
from planner.question import LostTile, Question, SurvivalSettings
from planner.recovery import Recovery
from planner.result import HandPlan, Slip, Survival, SurvivalShare
from planner.simulation.cascade import Cascade, CascadeOutcome, Flags, Loads, unit_names
from planner.simulation.plan_strengths import (
    plan_loads,
    strength_law,
    strength_sources,
    used_strengths,
    why_not_simulated,
)

__all__ = ["Draws", "draw_slips", "find_survival"]


@dataclass(frozen=True, slots=True)
class DrawSettings:
    """Settings of the draws of strengths."""

    slipped_palm: float = 0.01
    """Part of a palm's strength in shear that is left to new set-points after it has slipped [1]:
    with a strength of zero its rows would be scaled without bound."""
    seed_chunk: int = 50  # draws that come from one child of the seed
    fixed_piece: int = 200
    replanned_piece: int = 5
    """Largest number of draws between two looks at the deadline, and that a process takes at a
    time: at fixed tensions, and with new set-points."""
    hopeless: float = 10.0
    """Utilisation of new set-points over the strongest part's strength, beyond which all is lost
    [1]: they have the least utilisation, and what slips next hardly ever lowers it."""


DRAW_SETTINGS: Final = DrawSettings()


class Draws(NamedTuple):
    """Survival of a plan, and how each draw of strengths has ended.

    Attributes
    ----------
    survival : Survival
    used : ndarray, shape (T + H,)
        Utilisation of each tile's strength and of each palm's in shear in the plan.
    held, replanned : ndarray of bool, shape (n,)
        Whether all hands hold at last, at fixed tensions and with new set-points after each slip;
        empty where nothing was simulated.
    """

    survival: Survival
    used: Array
    held: Flags
    replanned: Flags


def find_survival(
    question: Question,
    hands: Sequence[HandPlan],
    settings: SurvivalSettings | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Survival:
    """Return the survival of a question's plan, with the draws that a deadline leaves time for.

    Parameters
    ----------
    question : Question
    hands : sequence of HandPlan
        The plan's hands, in the order of the stance.
    settings : SurvivalSettings, optional
        Draws of strengths; its defaults by default.
    workers : int, optional
        Number of processes that share the draws; the draws are the same whatever it is.
    progress : callable, optional
        Called after each piece of the draws with (number of pieces simulated, number of pieces).
    """
    settings = settings or SurvivalSettings()
    pieces = _pieces(settings, workers)
    make = partial(_simulating, question, hands, settings, pieces)
    prepared = prepare_stance(question)
    return _draw(prepared, hands, settings, pieces, None, make, workers, progress).survival


def draw_slips(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    settings: SurvivalSettings,
    strengths: Array | None = None,
) -> Draws:
    """Return the survival of a stance's plan, and how each draw has ended.

    With a deadline there are as many draws as it leaves time for.

    Parameters
    ----------
    prepared : PreparedStance
    hands : sequence of HandPlan
        The plan's hands, in the order of the stance.
    settings : SurvivalSettings
    strengths : ndarray, shape (draws, T + H), optional
        Strength of each tile and palm over that of its surface; drawn here by default.
    """
    return _draw(prepared, hands, settings, _pieces(settings, 1), strengths)


class _Piece(NamedTuple):
    """Draws from ``start`` to ``end``, at fixed tensions or with new set-points."""

    start: int
    end: int
    replanned: bool


class _Ends(NamedTuple):
    """Ends of the draws of a piece, (n,); of those with new set-points only ``held``."""

    held: Flags
    slips: Indices
    first: Indices


def _pieces(settings: SurvivalSettings, workers: int) -> list[_Piece]:
    """Return the pieces into which draws are divided: a deadline ends them between two pieces."""
    alone = workers == 1 and deadline.left() is None
    found = []
    for count, most, replanned in (
        (settings.draws, DRAW_SETTINGS.fixed_piece, False),
        (settings.replanned, DRAW_SETTINGS.replanned_piece, True),
    ):
        size = max(1, count if alone else min(most, -(-count // workers)))
        found += [_Piece(i, min(i + size, count), replanned) for i in range(0, count, size)]
    return found


class _Simulation:
    """Draws of a plan, and how they end."""

    def __init__(
        self,
        prepared: PreparedStance,
        hands: Sequence[HandPlan],
        settings: SurvivalSettings,
        strengths: Array | None,
    ) -> None:
        self._settings, self._given = settings, strengths
        self._law = strength_law(prepared, settings)
        self.cascade = Cascade(prepared, plan_loads(prepared, hands))
        table = bundled_table("slips.toml", "planner.parameters")
        late_slips = math.floor(settings.delay / table.positive("cascade", "interval") + 1e-9)
        self._replanned = _Replanned(prepared, self.cascade, late_slips)

    def strengths(self, start: int, end: int) -> Array:
        """Return the strengths of some draws: each chunk of them has a child of the seed."""
        if self._given is not None:
            return self._given[start:end]
        chunk = DRAW_SETTINGS.seed_chunk
        first, seed, c = start // chunk, self._settings.seed, self._settings.strength
        chunks = [
            self._law.sample(chunk, np.random.SeedSequence(seed, spawn_key=(k,)), c)
            for k in range(first, -(-end // chunk))
        ]
        return np.concatenate(chunks)[start - first * chunk : end - first * chunk]

    def ends(self, piece: _Piece) -> _Ends:
        """Return how the draws of a piece end."""
        deadline.check("all draws of strengths were simulated")
        strengths = self.strengths(piece.start, piece.end)
        if piece.replanned:
            none = np.zeros(0, dtype=np.intp)
            return _Ends(self._replanned.run(strengths), none, none)
        outcome = self.cascade.run(strengths)
        return _Ends(outcome.held, outcome.slips, outcome.first)


def _simulating(
    question: Question,
    hands: Sequence[HandPlan],
    settings: SurvivalSettings,
    pieces: Sequence[_Piece],
) -> Callable[[int], _Ends]:
    """Return the function that simulates a piece by its index; called in each process."""
    simulation = _Simulation(prepare_stance(question), hands, settings, None)
    return lambda index: simulation.ends(pieces[index])


def _draw(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    settings: SurvivalSettings,
    pieces: Sequence[_Piece],
    strengths: Array | None,
    make: Callable[[], Callable[[int], _Ends]] | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Draws:
    """Return the survival of a plan, from the pieces that are simulated until the deadline."""
    law, used = strength_law(prepared, settings), used_strengths(prepared, hands)
    found = Survival(
        no_slip=law.no_slip(used, settings.strength),
        strength_90=law.factor_for(used, 0.9),
        strength_99=law.factor_for(used, 0.99),
        strength=settings.strength,
        hold_scatter=law.scatter.hold,
        rock_scatter=law.scatter.rock,
        delay=settings.delay,
        seed=settings.seed,
        surfaces=strength_sources(prepared, law),
        reason=why_not_simulated(prepared),
    )
    none = np.zeros(0, dtype=bool)
    if found.reason is not None:
        return Draws(found, used, none, none)
    simulation = _Simulation(prepared, hands, settings, strengths)

    def here(index: int) -> _Ends:
        return simulation.ends(pieces[index])

    ended: dict[int, _Ends] = {}
    with suppress(deadline.DeadlineError):
        count = min(workers, len(pieces))
        for i, ends in by_index(make or (lambda: here), here, len(pieces), count):
            ended[i] = ends
            if progress is not None:
                progress(len(ended), len(pieces))
            if count > 1:
                deadline.check("all draws of strengths were simulated")
    fixed = [i for i in sorted(ended) if not pieces[i].replanned]
    anew = [none, *(ended[i].held for i in sorted(ended) if pieces[i].replanned)]
    replanned = np.concatenate(anew)
    if len(replanned):
        share = SurvivalShare.of(int(replanned.sum()), len(replanned))
        found = structs.replace(found, replanned=share)
    if not fixed:
        return Draws(found, used, none, replanned)
    held, slips, first = map(np.concatenate, zip(*(ended[i] for i in fixed), strict=True))
    number = np.concatenate([np.arange(pieces[i].start, pieces[i].end) for i in fixed])
    slipped, n = slips > 0, len(held)
    names = [" ".join(part for part in each if part) for each in unit_names(prepared)]
    counts = np.bincount(first[slipped], minlength=len(names))
    likely = [int(i) for i in np.argsort(-counts, kind="stable")[:10] if counts[i]]
    one = int(slips.argmax())
    own = simulation.strengths(int(number[one]), int(number[one]) + 1)[0]
    found = structs.replace(
        found,
        holds=SurvivalShare.of(int(held.sum()), n),
        slipped=SurvivalShare.of(int(slipped.sum()), n),
        first={names[i]: float(counts[i] / n) for i in likely},
        cascade=list(_steps(prepared, simulation.cascade, own)),
        cascade_holds=bool(held[one]),
    )
    return Draws(found, used, held, replanned)


def _steps(prepared: PreparedStance, cascade: Cascade, strengths: Array) -> Iterator[Slip]:
    """Yield the slips of one draw, one after the other."""
    names, states = unit_names(prepared), cascade.start(1)
    there = cascade.loads(states)
    while not there.lost[0]:
        over = there.used[0] / strengths
        unit = int(over.argmax())
        if over[unit] <= 1.0:
            return
        states = cascade.slipped(states, np.array([unit]))
        there = cascade.loads(states)
        most = float((there.used[0] / strengths).max())
        yield Slip(*names[unit], float(over[unit]), None if there.lost[0] else most)


class _Replanned:
    """Cascades with new set-points after each slip, a given number of slips late.

    The plan without what has slipped is made once for each set of tiles and palms. Draws that have
    lost the same go on together. A hand is lost once no tile of it holds, or where there is no plan
    at all; one that is overloaded counts, as its tiles may be stronger than assumed.
    """

    def __init__(self, prepared: PreparedStance, cascade: Cascade, late_slips: int) -> None:
        self._prepared, self._late, self._whole = prepared, late_slips, cascade
        self._tiles = len(prepared.batch.engagement)
        self._recoveries: dict[bytes, Recovery] = {}
        """By the palms that have slipped; all share hands and starts with that of none."""
        names = unit_names(prepared)[: self._tiles]
        self._names = [LostTile(limb, finger or "", phalanx) for limb, finger, phalanx in names]
        nothing = np.zeros(cascade.units, dtype=bool)
        self._plans: dict[bytes, Cascade | None] = {nothing.tobytes(): cascade}
        self._nothing = nothing

    def run(self, strengths: Array) -> Flags:
        """Return which draws (n, T + H) end with all hands holding."""
        held = np.ones(len(strengths), dtype=bool)
        waiting = {self._nothing.tobytes(): list(range(len(strengths)))}
        while waiting:
            deadline.check("all draws of strengths were simulated")
            key, draws = waiting.popitem()
            gone = np.frombuffer(key, dtype=bool)
            cascade = self._plan(gone)
            if cascade is None:
                held[draws] = False
                continue
            own = strengths[draws]
            over = cascade.used / own
            unit = over.argmax(axis=1)
            hopeless = cascade.used.max() > DRAW_SETTINGS.hopeless * own.max(axis=1)
            held[np.array(draws)[hopeless]] = False
            slip = (over[np.arange(len(own)), unit] > 1.0) & ~hopeless
            after = np.repeat(gone[None], len(own), axis=0)
            after[np.arange(len(own)), unit] |= slip
            if self._late:
                start = cascade.slipped(cascade.start(len(own)), unit)
                found: CascadeOutcome = cascade.run(own[slip], start[slip], most=self._late)
                held[np.array(draws)[slip][~found.held]] = False
                after[slip] = gone | cascade.gone(found.states)
                slip[slip] = found.held
            for draw, then in zip(np.array(draws)[slip].tolist(), after[slip], strict=True):
                waiting.setdefault(then.tobytes(), []).append(draw)
        return held

    def _plan(self, gone: Flags) -> Cascade | None:
        """Return the tables of the plan without what has slipped; None if a hand is lost."""
        key = gone.tobytes()
        if key not in self._plans:
            self._plans[key] = self._planned(gone)
        return self._plans[key]

    def _planned(self, gone: Flags) -> Cascade | None:
        tiles, palms = gone[: self._tiles], gone[self._tiles :]
        lost = [self._names[t] for t in np.flatnonzero(tiles)]
        found = self._without_palms(palms).plan(lost)
        if found.verified is None:
            return None
        arrays, batch = found.verified.arrays, self._prepared.batch
        loads = Loads.of(batch, arrays.loads, arrays.palms)
        # what the plan has taken off the rock holds no more than what has slipped
        idle = np.array([t.contact == "none" for hand in arrays.tiles for t in hand])
        off = tiles | (idle & (batch.touch.touches > 0.0))
        hands = len(batch.hands)
        before = np.bincount(batch.places.hand, batch.touch.touches, hands)
        left = np.bincount(batch.places.hand, batch.touch.touches * ~off, hands)
        if ((left == 0) & (before > 0)).any():
            return None
        return self._whole.replanned(loads, np.concatenate([off, palms]))

    def _without_palms(self, palms: Flags) -> Recovery:
        """Return the recovery of the stance with palms that have slipped in shear."""
        key, nothing = palms.tobytes(), np.zeros_like(palms)
        if key not in self._recoveries:
            prepared, like = self._prepared, None
            if palms.any():
                like, hands = self._without_palms(nothing), list(prepared.batch.hands)
                for h in np.flatnonzero(palms).tolist():
                    most = DRAW_SETTINGS.slipped_palm * hands[h].palm.shear_limit
                    weak = hands[h].palm._replace(shear_limit=most)
                    hands[h] = replace(hands[h], palm=weak)
                prepared = prepared.with_hands(hands)
            self._recoveries[key] = Recovery(prepared, many=True, like=like)
        return self._recoveries[key]
