"""Try a hand at many places of one rock, in batches on parallel worker processes."""

from __future__ import annotations

import math
import pickle
import time
from collections.abc import Callable, Generator, Sequence
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal, Self

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from service.bulk import Setting, answered, pool_on
from service.replies import ErrorReply
from service.wire import Answer, Format

if TYPE_CHECKING:
    from distributed import Client

    from hand_models.fixed_wrist import FoundHold, HoldTrial
    from hand_models.hand import Placing
    from hand_models.rock import Mesh

__all__ = ["HoldTrials"]


Found = Generator[tuple[int, "FoundHold | InvalidInputError"], None, None]


class HoldTrials:
    """Workers that try a hand at many places of one rock; they run inside a ``with`` block.

    Parameters
    ----------
    rock : Mesh
        Mesh of the rock.
    surface : str
        Name of a bundled surface.
    hand : ParameterTable
        Parameters of the hand.
    seat : {'rest', 'best'}, optional
        How a hand is seated at a place: as its grasp has it, or at the nearby pose with the
        strongest grip.
    placing : {'given', 'contact'}, optional
        Whether a hand stays where it is seated, or is moved to where it rests on the rock.
    force : float
        Force for which the share of sampled places that hold it is computed [N].
    on : str or distributed.Client, optional
        Where trials run: ``processes`` of this machine, ``here`` for this process alone,
        ``tcp://HOST:PORT`` of a Dask scheduler or its client, ``dask:local`` for a Dask cluster on
        this machine.
    workers : int, optional
        Number of worker processes of this machine; by default the number of cores.

    Raises
    ------
    InvalidInputError
        If ``on`` or ``workers`` is impossible.
    """

    def __init__(
        self,
        rock: Mesh,
        surface: str,
        hand: ParameterTable,
        *,
        seat: Literal["rest", "best"] = "rest",
        placing: Placing = "given",
        force: float,
        on: str | Client = "processes",
        workers: int | None = None,
    ) -> None:
        self._quick = seat == "rest" and placing == "given"
        make = partial(_trying, rock, surface, hand, seat, placing, force)
        self._pool = pool_on(on, workers, Setting(make=make))

    def __enter__(self) -> Self:
        self._pool.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._pool.__exit__(*error)

    def each(self, trials: Sequence[HoldTrial], *, samples: int = 0) -> Found:
        """Yield the index of each place with the outcome of its trial, batch by batch.

        Parameters
        ----------
        trials : sequence of HoldTrial
            Places and grasps to try.
        samples : int, optional
            Number of places near each one at which the hand is tried, too; none by default.

        Yields
        ------
        index : int
            Index in ``trials``; not in ascending order.
        found : FoundHold or InvalidInputError
            What the hand can hold there; an error where the hand cannot be there, or where its
            worker died.
        """
        # one that is searched for, or sampled, is many already; some fingers take ten times as
        # long as most, and so do the batches that they are in
        most = max(128 // (1 + samples), 1) if self._quick else 1
        batches = _batches(trials, most, self._pool.width)
        payloads = (pickle.dumps(([trials[i] for i in batch], samples)) for batch in batches)
        for batch, answer in zip(
            batches, answered(payloads, self._pool, Format.MSGPACK), strict=True
        ):
            yield from zip(batch, _outcomes(answer, len(batch)), strict=True)


def _batches(trials: Sequence[HoldTrial], most: int, width: int) -> list[list[int]]:
    """Return the indices of trials in batches, as many for each process."""
    # what hands at one place have alike is found once
    places = [list(of) for _, of in groupby(range(len(trials)), lambda i: trials[i][:3])]
    rounds = max(math.ceil(len(trials) / (most * width)), 1)
    size = max(math.ceil(len(places) / (rounds * width)), 1)
    # each all over the rock, so that what is broken off has been everywhere
    step = math.ceil(len(places) / size)
    return [[i for place in places[k::step] for i in place] for k in range(step)]


def _outcomes(answer: Answer, count: int) -> list[Any]:
    """Return what has come of so many trials; errors where they are lost."""
    if not answer.good:
        error = Format.MSGPACK.decode(answer.payload, ErrorReply).error
        return [InvalidInputError(error.message)] * count
    found: list[Any] = pickle.loads(answer.payload)
    return found


def _trying(
    rock: Mesh,
    surface: str,
    numbers: ParameterTable,
    seat: Literal["rest", "best"],
    placing: Placing,
    force: float,
) -> Callable[[bytes], Answer]:
    """Return the function that tries a batch of places; called once in each process."""
    from hand_models.fixed_wrist import try_holds
    from hand_models.hand import spiny_hand
    from hand_models.tile import Surface

    hand, surface_there = spiny_hand(numbers), Surface.named(surface)

    def answer(payload: bytes) -> Answer:
        start = time.perf_counter()
        trials, samples = pickle.loads(payload)
        found = try_holds(
            hand,
            rock,
            surface_there,
            trials,
            seat=seat,
            placing=placing,
            samples=samples,
            force=force,
        )
        encoding = "application/python-serialized-object"
        return Answer(pickle.dumps(found), encoding, seconds=time.perf_counter() - start)

    return answer
