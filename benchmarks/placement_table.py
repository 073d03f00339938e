"""What placing hands on a scan takes: all of it, and its parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.race import Way, race
from benchmarks.results import Line, Table, span, times
from hand_models import Grasp, SettledHand
from hand_models.fixed_wrist import (
    PULL_OFF,
    approach_frame,
    grid_of_trials,
    robustness,
    wrench_spaces,
)
from hand_models.hand import Placement, settle_hands
from hand_models.rock import Mesh, Triangles
from hand_models.rock.smoothing import Scale, smooth
from hand_models.rock.triangles import TriangleCells
from hand_models.sections import Section
from tests.suite.helpers.hands import HAND, ROCK, seating_on
from tests.suite.helpers.rocks import fractal_wall

__all__ = ["placement_tables"]

HANDS = 32
"""Placed together."""

WALLS = {1: 225, 2: 449, 4: 897}
"""Vertices along the side of square walls, by its length [m]."""

HURST = 0.8
"""Exponent by which the walls' steps grow with their length."""

Plane = tuple[ArrayLike, ArrayLike, ArrayLike]


class Watched(Mesh):
    """A mesh that tells in which planes it was cut."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.planes: list[Plane] = []

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        self.planes.append((origin, s_axis, t_axis))
        return super().section(origin, s_axis, t_axis)

    def pieces(self, plane: Plane) -> list[np.ndarray]:
        return self._pieces(*plane)


def placement_tables(rounds: int, tick: Callable[[], object]) -> list[Table]:
    """Measure, with so many rounds, hands all over a wall of 1 m² and 400,000 triangles."""
    wall = Watched(*fractal_wall(0, size=1.0, count=448, height=0.01), anywhere=True)
    trials = grid_of_trials(wall, 0.1, 4, (0.0, math.pi), radius=0.055)
    chosen = np.random.default_rng(0).permutation(len(trials))[:HANDS]
    placements = [
        Placement(
            wall,
            ROCK,
            Grasp(each.outer_rotation),
            None,
            approach_frame(each.point, each.approach, each.wrist_angle),
        )
        for each in (trials[i] for i in chosen)
    ]
    seats = [seating_on(each.hold, each.grasp, each.at) for each in placements]
    wall.planes.clear()
    hands = [each for each in settle_hands(HAND, placements) if isinstance(each, SettledHand)]
    planes, scale = wall.planes, Scale.of()
    pieces = [wall.pieces(plane) for plane in planes]
    cells, reach = TriangleCells(wall.triangles), scale.reach
    seated = [
        each._replace(hold_in_hand=own.pose, at=None)
        for each, own in zip(placements, seats, strict=True)
    ]

    def crop(plane: Plane) -> object:
        origin, s, t = (np.asarray(values, dtype=float) for values in plane)
        axes, beside = np.array([np.cross(s, t), s, t]), np.array([0.0, reach, reach])
        return cells.within(axes, axes @ origin - beside, axes @ origin + beside)

    def supports(hands: list[SettledHand]) -> list[float]:
        # of copies, which nobody has asked yet
        return [space.support(PULL_OFF) for space in wrench_spaces(list(map(replace, hands)))]

    made = len(planes)
    timed = race(
        {
            "all": lambda _: settle_hands(HAND, placements),
            "crop": lambda _: [crop(plane) for plane in planes[:made]],
            "cut": lambda _: [wall.pieces(plane) for plane in planes[:made]],
            "smooth": lambda _: [[smooth(run, scale) for run in each] for each in pieces],
            "seat": lambda _: [seating_on(each.hold, each.grasp, each.at) for each in placements],
            "close": lambda _: settle_hands(HAND, seated),
            "set": lambda _: supports(hands),
            "robust": lambda k: robustness(HAND, hands[k % len(hands)], PULL_OFF, seed=k),
        },
        rounds,
        tick,
    )

    def line(what: str, name: str) -> Line:
        each = timed.median(name) / HANDS
        return Line(what, (span(each), f"{1.0 / each:.0f}", times(timed.ratio(name, "all"))))

    return [
        Table(
            f"Hands placed on a scan of 400,000 triangles, {HANDS} together, on one core",
            ("median of each", "a second", "× placed"),
            [
                line("**placed: seated and closed**", "all"),
                line("the triangles near its cuts (crop)", "crop"),
                line("its cuts, crop and all", "cut"),
                line("these smoothed", "smooth"),
                line("seated, with the cuts that needs", "seat"),
                line("closed where it is seated, with the cuts that needs", "close"),
                line("its wrench set, and how far that reaches", "set"),
            ],
            f"{made / HANDS:.1f} cuts each. The 50 draws of one hand's robustness take "
            f"{span(timed.median('robust'))}.",
        ),
        _larger_walls(rounds, tick),
    ]


def _larger_walls(rounds: int, tick: Callable[[], object]) -> Table:
    """Measure look-ups at the same places in the middle of larger and larger walls."""
    rng, reach = np.random.default_rng(0), Scale.of().reach
    places = np.column_stack([rng.uniform(-0.2, 0.2, (100, 2)), np.zeros(100)])
    into, beside = np.array([0.0, 0.0, 1.0]), np.array([0.0, reach, reach])
    slabs = [
        np.array(
            [[-math.sin(turn), math.cos(turn), 0.0], [math.cos(turn), math.sin(turn), 0.0], into]
        )
        for turn in rng.uniform(0.0, math.tau, 100)
    ]
    ways: dict[tuple[str, int], Way] = {}
    for side, count in WALLS.items():
        # as rough as the smallest at every scale
        wall = fractal_wall(0, size=side, count=count, height=0.01 * side**HURST, hurst=HURST)
        cells = TriangleCells(Triangles(*wall))

        def crops(_: int, cells: TriangleCells = cells) -> object:
            return [
                cells.within(axes, axes @ place - beside, axes @ place + beside)
                for axes, place in zip(slabs, places, strict=True)
            ]

        ways["crop", side] = crops
        ways["ray", side] = lambda _, cells=cells: cells.lines(places, into)
    timed = race(ways, rounds, tick)

    def line(side: int) -> Line:
        cells: list[str] = []
        for name in ("crop", "ray"):
            cells += [span(timed.median((name, side)) / len(places))]
            cells += [times(timed.ratio((name, side), (name, 1)))]
        return Line(f"{side**2} m²", tuple(cells))

    return Table(
        "Look-ups in larger scans of the same rock, triangles 4.5 mm wide",
        ("triangles near a cut", "× 1 m²", "ray", "× 1 m²"),
        list(map(line, WALLS)),
        "0.1, 0.4 and 1.6 million triangles.",
    )
