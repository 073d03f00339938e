"""How long plans take as stances grow: more hands, more tiles, finer limits, more workers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from benchmarks.measured_stances import question_of, twin_of
from benchmarks.plain_programs import Clarabel, scaled, unique
from benchmarks.race import TURN, WARM, Way, race
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import HandSets, Sets, assemble
from planner.programs import program, solvers
from planner.question import Question
from planner.solving import plan
from tests.suite.helpers.crawlers import crawler_in, crawler_question

__all__ = ["Curve", "draw", "growth", "steps"]

HANDS = (1, 2, 4, 8, 12, 16)
TILES = (1, 2, 4, 7, 10, 14)
HALF_PLANES = (1, 2, 4, 8, 16, 32)
"""Of each tile."""


class Curve(NamedTuple):
    """Medians [s] of each quantity named, over sizes."""

    title: str
    axis: str
    sizes: tuple[int, ...]
    medians: dict[str, list[float]]


PLAN = "whole plan, new stance"
DATA = "hold → data"
OURS = "program"
RAW = "program, raw Clarabel"


def growth(rounds: int, every: int, tick: Callable[[], object]) -> list[Curve]:
    """Measure every curve, at every size or only every so many, with so many rounds."""
    return [
        _hands(HANDS[::every], rounds, tick),
        _half_planes(HALF_PLANES[::every], rounds, tick),
        _tiles(TILES[::every], rounds, tick),
    ]


def steps(rounds: int) -> int:
    """How often `growth` ticks."""
    return 3 * rounds


def _hands(sizes: Sequence[int], rounds: int, tick: Callable[[], object]) -> Curve:
    with TemporaryDirectory() as folder:
        robot = crawler_in(Path(folder))
        return _curve(
            "more hands (a robot with 16 limbs)",
            "hands",
            sizes,
            lambda size, seed: crawler_question(robot, size, joints=False, seed=seed),
            rounds,
            tick,
        )


def _half_planes(sizes: Sequence[int], rounds: int, tick: Callable[[], object]) -> Curve:
    def asked(size: int, seed: int) -> Question:
        question = question_of(seed)
        hands = tuple(
            replace(hand, surface=replace(hand.surface, half_planes=size))
            for hand in question.stance.hands
        )
        return replace(question, stance=replace(question.stance, hands=hands))

    title = "finer limits (4 hands, 56 tiles)"
    return _curve(title, "half-planes for each tile", sizes, asked, rounds, tick)


def _curve(
    title: str,
    axis: str,
    sizes: Sequence[int],
    asked: Callable[[int, int], Question],
    rounds: int,
    tick: Callable[[], object],
) -> Curve:
    """Whole plans of new stances, the model's part of these, and the program's."""
    ways: dict[tuple[str, int], Way] = {}
    for size in sizes:
        questions = [asked(size, seed) for seed in range(rounds + WARM)]
        plans, others = ([twin_of(each, twin) for each in questions] for twin in (1, 2))
        ways[PLAN, size] = lambda k, plans=plans: plan(plans[k])
        ways[DATA, size] = lambda k, others=others: _sets(others[k])
        ways |= _programs(size, [_sets(each) for each in questions])
    return _raced(title, axis, sizes, ways, rounds, tick)


def _programs(size: int, sets: Sequence[Sets]) -> dict[tuple[str, int], Way]:
    raw = Clarabel([unique(scaled(each)) for each in sets], program.SHARP_SETTINGS)
    return {(OURS, size): lambda k: solvers.unique(sets[k].data), (RAW, size): raw.updated}


def _raced(
    title: str,
    axis: str,
    sizes: Sequence[int],
    ways: Mapping[tuple[str, int], Way],
    rounds: int,
    tick: Callable[[], object],
) -> Curve:
    """Time all ways of all sizes in turns, so that noise does not bend the curve."""
    timed = race(ways, rounds, tick, TURN // 4)
    names = dict.fromkeys(name for name, _ in ways)
    medians = {name: [timed.median((name, size)) for size in sizes] for name in names}
    return Curve(title, axis, tuple(sizes), medians)


def _sets(question: Question) -> Sets:
    hands = _gathered(question)
    return hands.sets(hands.at_rest())


def _gathered(question: Question) -> HandSets:
    return assemble(question, None, question.needed_wrench())[1]


def _tiles(sizes: Sequence[int], rounds: int, tick: Callable[[], object]) -> Curve:
    """The program alone, with the limits of a few tiles of each hand and of no others."""
    stances = [_gathered(question_of(number)) for number in range(rounds + WARM)]
    ways: dict[tuple[str, int], Way] = {}
    for size in sizes:
        fewer = [
            hands.with_sets([_with_tiles(space, size) for space in hands.spaces])
            for hands in stances
        ]
        ways |= _programs(size, [hands.sets(hands.at_rest()) for hands in fewer])
    return _raced("more tiles (4 hands)", "tiles of each hand", sizes, ways, rounds, tick)


def _with_tiles(space: WrenchSpace, count: int) -> WrenchSpace:
    """The set without the rows of any but the first tiles."""
    tiles = dict.fromkeys((row.finger, row.phalanx) for row in space.rows if row.phalanx)
    chosen = set(list(tiles)[:count])
    kept = [row.phalanx is None or (row.finger, row.phalanx) in chosen for row in space.rows]
    limits, hard = np.array(kept[: len(space.s)]), np.array(kept[len(space.s) :])
    return replace(
        space,
        rows=tuple(row for row, keep in zip(space.rows, kept, strict=True) if keep),
        L=space.L[limits],
        l0=space.l0[limits],
        s=space.s[limits],
        H=space.H[hard],
        h=space.h[hard],
    )


SPAN = 8.0
"""Least ratio of the ends of a logarithmic axis."""

COLOURS = {PLAN: "tab:blue", DATA: "tab:green", OURS: "tab:orange", RAW: "0.3"}


def draw(curves: Sequence[Curve], speeds: dict[str, list[tuple[int, float]]], path: Path) -> None:
    """Draw growth with size, and throughput over workers (plans a second), into a file."""
    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2).ravel()
    for ax, curve in zip(axes, curves, strict=False):
        _draw_curve(ax, curve)
    _draw_speeds(axes[-1], speeds)
    figure.savefig(path, dpi=110)


def _draw_curve(ax: Axes, curve: Curve) -> None:
    for name, seconds in curve.medians.items():
        ax.plot(curve.sizes, 1e3 * np.array(seconds), "o-", color=COLOURS[name], label=name)
    ax.set_xscale("log", base=2)
    ax.set_yscale("log")
    ax.set_xticks(curve.sizes, [str(size) for size in curve.sizes])
    ax.minorticks_off()
    # most of a decade at least, so that there are ticks to read, and noise looks as small as it is
    low, high = ax.get_ylim()
    wider = max(1.0, SPAN * low / high) ** 0.5
    ax.set_ylim(low / wider, high * wider)
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.set_title(curve.title)
    ax.set_xlabel(curve.axis)
    ax.set_ylabel("median time [ms]")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")


def _draw_speeds(ax: Axes, speeds: dict[str, list[tuple[int, float]]]) -> None:
    for name, points in speeds.items():
        workers, rates = zip(*points, strict=True)
        ax.plot(workers, rates, "o-", label=name)
    ax.set_xticks(sorted({workers for points in speeds.values() for workers, _ in points}))
    ax.set_title("batches of new stances (4 hands)")
    ax.set_xlabel("workers")
    ax.set_ylabel("plans a second [1/s]")
    ax.set_ylim(bottom=0.0)
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
