"""Hands tried at many places of one rock, in processes."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Final, Literal

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner import Lost, Workers, cores

if TYPE_CHECKING:
    from hand_models.fixed_wrist import FoundHold, Trial
    from hand_models.rock import Mesh

__all__ = ["try_everywhere"]

TOGETHER: Final = 128
"""Trials that are closed in one batch, at most: some fingers take ten times as long as most, and so
do the batches that they are in, whatever else is in these."""

Found = list["FoundHold | InvalidInputError"]


def try_everywhere(
    rock: Mesh,
    surface: str,
    trials: Sequence[Trial],
    hand: ParameterTable,
    *,
    seat: Literal["rest", "best"] = "rest",
    robust: bool = False,
    workers: int | None = None,
) -> Generator[tuple[int, FoundHold | InvalidInputError], None, None]:
    """Yield each place's index, and what a hand holds there, as they are done.

    Parameters
    ----------
    rock : Mesh
    surface : str
        A preset's name.
    trials : sequence of Trial
    hand : ParameterTable
        Its numbers.
    seat : {'rest', 'best'}, optional
    robust : bool, optional
        As of `hand_models.fixed_wrist.try_holds`.
    workers : int, optional
        Processes, this one among them; by default one a core.

    Yields
    ------
    index : int
    found : FoundHold or InvalidInputError
        An error in place of a hand that cannot be there, or whose process died.
    """
    count = cores() if workers is None else workers
    # one that is searched for, or scattered, is many already
    most = TOGETHER if seat == "rest" and not robust else 1
    # what hands at one place have alike is found once
    places = [list(of) for _, of in groupby(range(len(trials)), lambda i: trials[i][:3])]
    # as many for each process
    rounds = max(math.ceil(len(trials) / (most * count)), 1)
    size = max(math.ceil(len(places) / (rounds * count)), 1)
    # each all over the rock, so that what is broken off has been everywhere
    step = math.ceil(len(places) / size)
    chunks = [[i for place in places[k::step] for i in place] for k in range(step)]
    parts = [[trials[i] for i in chunk] for chunk in chunks]
    make = partial(_trying, rock, surface, hand, seat, robust)
    with Workers(make, min(count, len(chunks)) - 1) as others:
        for k, results in others.each(parts, make()):
            if isinstance(results, Lost):
                results = [InvalidInputError(results.reason) for _ in chunks[k]]
            yield from zip(chunks[k], results, strict=True)


def _trying(
    rock: Mesh, surface: str, numbers: ParameterTable, seat: Literal["rest", "best"], robust: bool
) -> Callable[[Sequence[Trial]], Found]:
    """Return what tries a few places; called once in each process."""
    from hand_models.fixed_wrist import try_holds
    from hand_models.hand import spiny_hand
    from hand_models.tile import Surface

    hand = spiny_hand(numbers)
    return partial(try_holds, hand, rock, Surface.named(surface), seat=seat, robust=robust)
