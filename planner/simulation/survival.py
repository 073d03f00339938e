"""Survival of a plan: the probability that no tile slips, and that all hands hold if some do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from typing import Final, NamedTuple

import numpy as np
from msgspec import structs

from hand_models.base import Array
from hand_models.hand import NAIL, SettledHand
from hand_models.parameters import ParameterTable, surface_table
from hand_models.tile import StrengthScatter, Surface, TileStrengths
from planner import deadline
from planner.prepare import PreparedStance, prepare_stance
from planner.question import LostTile, Question, SurvivalSettings
from planner.recovery import Recovery
from planner.result import HandPlan, Slip, StrengthSource, Survival, SurvivalShare
from planner.simulation.cascade import Cascade, CascadeOutcome, Flags, Loads, unit_names

__all__ = ["Draws", "draw_slips", "find_survival", "plan_loads"]

SLIPPED_PALM: Final = 0.01
"""Part of a palm's strength in shear that is left to new set-points after it has slipped: with a
strength of zero its rows would be scaled without bound."""


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
    question: Question, hands: Sequence[HandPlan], settings: SurvivalSettings | None = None
) -> Survival:
    """Return the survival of a question's plan.

    Parameters
    ----------
    question : Question
    hands : sequence of HandPlan
        The plan's hands, in the order of the stance.
    settings : SurvivalSettings, optional
        Draws of strengths; its defaults by default.

    Raises
    ------
    DeadlineError
        If the deadline passes before all draws were simulated.
    """
    settings = settings or SurvivalSettings()
    return draw_slips(prepare_stance(question), hands, settings).survival


def draw_slips(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    settings: SurvivalSettings,
    strengths: Array | None = None,
) -> Draws:
    """Return the survival of a stance's plan, and how each draw has ended.

    Parameters
    ----------
    prepared : PreparedStance
    hands : sequence of HandPlan
        The plan's hands, in the order of the stance.
    settings : SurvivalSettings
    strengths : ndarray, shape (draws, T + H), optional
        Strength of each tile and palm over that of its surface; drawn here by default.

    Raises
    ------
    DeadlineError
        If the deadline passes before all draws were simulated.
    """
    batch, scatter = (
        prepared.batch,
        StrengthScatter.bundled(settings.hold_scatter, settings.rock_scatter),
    )
    hand_of = np.concatenate([batch.places.hand, np.arange(len(hands))])
    law = TileStrengths.of([hand.surface for hand in batch.hands], hand_of, scatter)
    used = _used(prepared, hands)
    found = Survival(
        no_slip=law.no_slip(used, settings.strength),
        strength_90=law.factor_for(used, 0.9),
        strength_99=law.factor_for(used, 0.99),
        strength=settings.strength,
        hold_scatter=scatter.hold,
        rock_scatter=scatter.rock,
        delay=settings.delay,
        seed=settings.seed,
        surfaces=_sources(prepared, law),
        reason=_why_not(prepared),
    )
    none = np.zeros(0, dtype=bool)
    if found.reason is not None:
        return Draws(found, used, none, none)
    if strengths is None:
        strengths = law.sample(settings.draws, settings.seed, settings.strength)
    cascade, n = Cascade(prepared, plan_loads(prepared, hands)), settings.draws
    outcome = cascade.run(strengths)
    slipped = outcome.slips > 0
    names = [" ".join(part for part in each if part) for each in unit_names(prepared)]
    counts = np.bincount(outcome.first[slipped], minlength=len(names))
    likely = [int(i) for i in np.argsort(-counts, kind="stable")[:10] if counts[i]]
    replanned, anew = None, none
    if settings.replanned:
        late_slips = math.floor(settings.delay / _interval() + 1e-9)
        anew = _Replanned(prepared, cascade, late_slips).run(strengths[: settings.replanned])
        replanned = SurvivalShare.of(int(anew.sum()), settings.replanned)
    deadline.check("all draws of strengths were simulated")
    one = int(outcome.slips.argmax())
    found = structs.replace(
        found,
        holds=SurvivalShare.of(int(outcome.held.sum()), n),
        slipped=SurvivalShare.of(int(slipped.sum()), n),
        replanned=replanned,
        first={names[i]: float(counts[i] / n) for i in likely},
        cascade=list(_steps(prepared, cascade, strengths[one])),
        cascade_holds=bool(outcome.held[one]),
    )
    return Draws(found, used, outcome.held, anew)


def plan_loads(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Loads:
    """Return the loads of a plan's hands over all of them."""
    tiles = np.concatenate([hand.loads for hand in hands])
    palms = np.array([hand.palm.force for hand in hands])
    first = prepared.batch.places.first_of_finger
    return Loads(
        tiles,
        np.add.reduceat(tiles[:, 2], first),
        np.column_stack([-palms[:, 0], palms[:, 2]]),
    )


def _used(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Array:
    """Return what the plan uses of each tile's strength and each palm's in shear, (T + H,)."""
    tiles = np.concatenate([hand.tile_utilisations for hand in hands])
    sheared = plan_loads(prepared, hands).palms[:, 0] / prepared.batch.palm_limits[:, 0]
    return np.concatenate([tiles * prepared.batch.touch.touches, sheared])


def _sources(prepared: PreparedStance, law: TileStrengths) -> list[StrengthSource]:
    """Return the distribution of the tiles on each surface of a stance."""
    found: dict[Surface, StrengthSource] = {}
    sections = surface_table().sections
    pairs = zip(prepared.batch.hands, law.modulus.tolist(), law.mean.tolist(), strict=True)
    for hand, modulus, mean in pairs:
        surface, source = hand.surface, "given"
        if surface.name in sections:
            own = sections[surface.name]
            source = own.get("scatter_ratio", sections["defaults"]["scatter_ratio"]).source
        variation = surface.shear_scatter / surface.shear_limit
        found[surface] = StrengthSource(surface.name, modulus, variation, source, mean)
    return list(found.values())


def _why_not(prepared: PreparedStance) -> str | None:
    """Return why slips of a stance are not simulated; None if they are."""
    moving = prepared.floating
    if moving:
        return (
            f"slips are not simulated, as the wrists of {', '.join(moving)} move: where they go "
            "once a tile slips takes a search for each state; valid is wrist 'fixed'"
        )
    nails = [
        limb
        for limb, hand in zip(prepared.limbs, prepared.batch.hands, strict=True)
        if hand.grasp.fingernail or any(tile.contact == NAIL for tile in hand.tiles)
    ]
    if nails:
        return (
            f"slips are not simulated, as {', '.join(nails)} hold with fingernails, whose scatter "
            "nobody has measured"
        )
    return None


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


@cache
def _interval() -> float:
    """Return the time from one slip to the next [s]."""
    path = resources.files("planner.parameters").joinpath("slips.toml")
    return ParameterTable.read(path.read_text("utf-8"), path.name).positive("cascade", "interval")


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
            slip = over[np.arange(len(own)), unit] > 1.0
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
        if palms.tobytes() not in self._recoveries:
            self._recoveries[palms.tobytes()] = Recovery(self._without_palms(palms))
        lost = [self._names[t] for t in np.flatnonzero(tiles)]
        found = self._recoveries[palms.tobytes()].plan(lost)
        if found.verified is None:
            return None
        arrays, batch = found.verified.arrays, self._prepared.batch
        loads = Loads(
            arrays.loads,
            np.add.reduceat(arrays.loads[:, 2], batch.places.first_of_finger),
            arrays.palms[:, ::2] * [-1.0, 1.0],
        )
        # what the plan has taken off the rock holds no more than what has slipped
        idle = np.array([t.contact == "none" for hand in arrays.tiles for t in hand])
        off = tiles | (idle & (batch.touch.touches > 0.0))
        hands = len(batch.hands)
        before = np.bincount(batch.places.hand, batch.touch.touches, hands)
        left = np.bincount(batch.places.hand, batch.touch.touches * ~off, hands)
        if ((left == 0) & (before > 0)).any():
            return None
        return self._whole.replanned(loads, np.concatenate([off, palms]))

    def _without_palms(self, palms: Flags) -> PreparedStance:
        """Return the stance with palms that have slipped in shear."""
        if not palms.any():
            return self._prepared
        hands: list[SettledHand] = []
        for hand, slipped in zip(self._prepared.batch.hands, palms.tolist(), strict=True):
            weak = hand.palm._replace(shear_limit=SLIPPED_PALM * hand.palm.shear_limit)
            hands.append(replace(hand, palm=weak) if slipped else hand)
        return self._prepared.with_hands(hands)
