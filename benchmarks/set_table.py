"""What a hand's wrench space takes, beside pycapacity and the paper's own search."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from pycapacity.algorithms import hyper_plane_shift_method
from scipy.spatial import KDTree

from benchmarks.paper_search import searched
from benchmarks.race import race
from benchmarks.results import Table, lines
from hand_models.fixed_wrist import wrench_space
from hand_models.fixed_wrist.tension_box import parallelepiped
from hand_models.wrench_spaces import WRENCH_SCALE
from tests.suite.helpers.hands import pinch
from tests.suite.helpers.zonotopes import half_spaces

__all__ = ["set_tables"]

GENERATORS = 12
"""Of the zonotope in 6-D."""


def set_tables(rounds: int, few: int, step: float, tick: Callable[[], object]) -> list[Table]:
    """Measure, with so many rounds, and few of the paper's search with steps [N] of tensions."""
    return [_zonotope(rounds, tick), _hand(few, step, tick)]


def _zonotope(rounds: int, tick: Callable[[], object]) -> Table:
    rng = np.random.default_rng(0)
    sets = [
        (
            rng.normal(size=(6, GENERATORS)),
            rng.uniform(-1.0, 0.0, GENERATORS),
            rng.uniform(0.5, 1.0, GENERATORS),
        )
        for _ in range(8)
    ]

    def ours(number: int) -> np.ndarray:
        found = half_spaces(*sets[number % len(sets)])
        return np.column_stack([found.normals, found.offsets])

    def theirs(number: int) -> np.ndarray:
        H, d = hyper_plane_shift_method(*sets[number % len(sets)])
        return np.column_stack([H, np.ravel(d)])

    one, other = ours(0), theirs(0)
    far = max(KDTree(one).query(other)[0].max(), KDTree(other).query(one)[0].max())
    assert len(one) == len(other)
    assert far < 1e-9
    timed = race({"ours": ours, "pycapacity": theirs}, rounds, tick)
    return Table(
        f"Half-spaces of a zonotope: {GENERATORS} generators in 6-D, {len(one)} facets",
        ("median", "× ours"),
        lines(
            timed,
            ["ours"],
            ("`hand_models.wrench_spaces`, a sum of segments", "ours"),
            ("pycapacity, `hyper_plane_shift_method`", "pycapacity"),
        ),
        f"The same half-spaces, to {far:.0e}.",
    )


def _hand(rounds: int, step: float, tick: Callable[[], object]) -> Table:
    """A pinch on a 300 mm cylinder, its tensions alone."""
    settled = pinch(0.3)

    def ours(_: int) -> None:
        parallelepiped(settled).half_spaces()

    def search(_: int) -> None:
        searched(settled, step)

    whole = wrench_space(settled)

    def everything(_: int) -> None:
        dataclasses.replace(whole).half_spaces()

    cloud, hull = searched(settled, step)
    space = parallelepiped(settled)
    missed = 0.0
    for direction in np.random.default_rng(0).normal(size=(200, 6)) * WRENCH_SCALE:
        reach = space.support(direction)
        width = reach + space.support(-direction)
        short = (reach - float((cloud @ direction).max())) / width
        assert short > -1e-9
        missed = max(missed, short)
    timed = race({"ours": ours, "search": search, "everything": everything}, rounds, tick)
    return Table(
        "Wrench space of a settled hand, four tensions: f_t(max) and half-spaces",
        ("median", "× ours"),
        lines(
            timed,
            ["ours"],
            ("Eq. 16 in closed form (`parallelepiped`)", "ours"),
            (
                f"the paper's search, tensions stepped by {step:g} N: {len(cloud)} wrenches, "
                f"{len(hull.equations)} triangulated facets",
                "search",
            ),
            ("for comparison: with palm, lateral reactions and all limits", "everything"),
        ),
        f"The search falls short by up to {100.0 * missed:.1f} % of the set's width.",
    )
