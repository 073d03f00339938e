"""Hands tried at many places of one rock, in processes."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner.processes import Lost, Workers, cores

if TYPE_CHECKING:
    from hand_models.fixed_wrist import FoundHold, Trial
    from hand_models.rock import Mesh

__all__ = ["RockTrials", "try_everywhere"]

TOGETHER: Final = 128
"""Trials that are closed in one batch, at most: some fingers take ten times as long as most, and so
do the batches that they are in, whatever else is in these."""

Found = list["FoundHold | InvalidInputError"]


class RockTrials(NamedTuple):
    """How hands are tried on a rock.

    Attributes
    ----------
    rock : Mesh
    surface : str
        A preset's name.
    seat : {'rest', 'best'}
    robust : bool
        As of `hand_models.fixed_wrist.try_holds`.
    hand : ParameterTable or None
        The hand; the bundled one if None.
    """

    rock: Mesh
    surface: str
    seat: Literal["rest", "best"] = "rest"
    robust: bool = False
    hand: ParameterTable | None = None

    def trying(self) -> Callable[[Sequence[Trial]], Found]:
        """Return what tries a few places; called once in each process."""
        from hand_models.fixed_wrist import try_holds
        from hand_models.hand import spiny_hand
        from hand_models.tile import Surface

        hand, surface = spiny_hand(self.hand), Surface.named(self.surface)
        return partial(try_holds, hand, self.rock, surface, seat=self.seat, robust=self.robust)


def try_everywhere(
    how: RockTrials, trials: Sequence[Trial], workers: int | None = None
) -> Generator[tuple[int, FoundHold | InvalidInputError], None, None]:
    """Yield each place's index, and what a hand holds there, as they are done.

    Parameters
    ----------
    how : RockTrials
    trials : sequence of Trial
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
    most = TOGETHER if how.seat == "rest" and not how.robust else 1
    # what hands at one place have alike is found once
    places = [list(of) for _, of in groupby(range(len(trials)), lambda i: trials[i][:3])]
    # as many for each process
    rounds = max(math.ceil(len(trials) / (most * count)), 1)
    size = max(math.ceil(len(places) / (rounds * count)), 1)
    # each all over the rock, so that what is broken off has been everywhere
    step = math.ceil(len(places) / size)
    chunks = [[i for place in places[k::step] for i in place] for k in range(step)]
    parts = [[trials[i] for i in chunk] for chunk in chunks]
    with Workers(how.trying, min(count, len(chunks)) - 1) as others:
        for k, results in others.each(parts, how.trying()):
            if isinstance(results, Lost):
                results = [InvalidInputError(results.reason) for _ in chunks[k]]
            yield from zip(chunks[k], results, strict=True)
