"""Interpolations that follow a changing wrench: the newest, the previous one, and the next.

When the wrench drifts from the centre of the newest interpolation, a thread solves the plans of the
next one, about where the wrench is going. Where the wrench comes again, what was found there is
used again. All weights change continuously with the wrench:

- the weight φ of an interpolation falls from 1 to 0 in its outermost shell;
- the share τ of a new interpolation grows from 0 to 1 with the distance that the wrench moves after
  that interpolation was taken over; its weight is τ φ, that of the previous one (1 − τ) φ.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from planner import deadline
from planner.streaming.interpolation import PER_RADIUS, Interpolation
from planner.streaming.stream_stance import StreamStance

__all__ = ["Mixture", "Prefetch"]

log = logging.getLogger(__name__)

MOST_KEPT: Final = 16
"""Number of interpolations that are kept for a wrench that comes again, some 10 kB each."""


class Mixture(NamedTuple):
    """Mixture of interpolations at a body wrench.

    Attributes
    ----------
    weight : float
        Total weight of the interpolations, 0 to 1; 0 where none covers the wrench.
    loads : ndarray, shape (hands, m)
        Mixed loads y of each hand, padded with zeros [N].
    bound : float
        Lower bound of the least utilisation.
    distance : float
        Distance ``Σ |t|`` from the newest centre, in radii; infinite without an interpolation.
    """

    weight: float
    loads: Array
    bound: float
    distance: float


class Prefetch:
    """Interpolations about a body wrench that changes from call to call, solved ahead in a thread.

    Not thread-safe: `WrenchStream` guards every call with its lock.

    Parameters
    ----------
    stance : StreamStance
    radius : float
        Radius of the interpolations along a force [N]; smaller near the boundary of the feasible
        wrenches.

    Attributes
    ----------
    newest : Interpolation or None
        The interpolation that was solved last and is in use.
    coming : Future or None
        The next interpolation, which the thread is solving.
    """

    def __init__(self, stance: StreamStance, radius: float) -> None:
        self._stance, self._radius = stance, radius
        self._per = 1.0 / (radius * PER_RADIUS)
        self._thread: ThreadPoolExecutor | None = ThreadPoolExecutor(1, "crux-stream")
        self.coming: Future[Interpolation | None] | None = None
        self._before: Interpolation | None = None
        self._fading, self._fade = 1.0, 0.0
        """τ, and the way over which it grows, in radii."""
        self.newest = self._found([stance.first])
        self._kept = deque([] if self.newest is None else [self.newest], MOST_KEPT)
        self._missed: Array | None = stance.first if self.newest is None else None
        """Wrench at which an interpolation was asked for that is not there."""

    def close(self) -> ThreadPoolExecutor | None:
        """Stop solving interpolations; return the thread pool, for the caller to shut down."""
        thread, self._thread = self._thread, None
        return thread

    def submit(self, work: Callable[..., object], *given: object) -> None:
        """Let the thread do some other work, unless it was stopped."""
        if self._thread is not None:
            self._thread.submit(work, *given)

    def go(self, last: Array, wrench: Array) -> None:
        """Update the weights for a new body wrench, and take over an interpolation that is ready.

        Parameters
        ----------
        last, wrench : ndarray, shape (6,)
            Previous and new body wrench, in B [N, N·m].
        """
        if self.coming is not None and self.coming.done():
            self._take_over(self.coming, last)
        if self._fading < 1.0:
            self._fading = min(self._fading + self._way(last, wrench) / self._fade, 1.0)
        if self._fading >= 1.0:
            self._before = None

    def mixture(self, wrench: Array) -> Mixture:
        """Return the mixture of the interpolations at a body wrench (6,) in B [N, N·m]."""
        weight, loads, bound, distance = 0.0, np.zeros((0, 0)), -math.inf, math.inf
        if self.newest is not None:
            distance, loads = self.newest.at(wrench)
            weight = self._fading * _weight(distance)
            loads, bound = loads.reshape(self._stance.shape), self.newest.bound(wrench)
        if self._before is not None:
            far, others = self._before.at(wrench)
            part = (1.0 - self._fading) * _weight(far)
            if part > 0.0:
                mixed = weight * loads + part * others.reshape(self._stance.shape)
                weight += part
                loads, bound = mixed / weight, max(bound, self._before.bound(wrench))
        return Mixture(weight, loads, bound, distance)

    def look_ahead(self, wrench: Array, distance: float) -> None:
        """Start solving the next interpolation if the wrench is far from the newest centre.

        One that was found before is next if its centre is near.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Body wrench in B [N, N·m].
        distance : float
            Distance of the wrench from the newest centre, in radii (`Mixture.distance`).
        """
        if self.coming is not None or self._thread is None:
            return
        # what was not found is looked for again a quarter of a radius away
        if self._missed is not None and self._way(self._missed, wrench) < 0.25:
            return
        centres = [wrench]
        if self.newest is not None:
            if distance < 0.5 or (self._fading < 1.0 and distance < 1.0):  # half-way out
                return
            if distance < 1.0:
                # ahead by half of the way from the last centre
                centres.insert(0, wrench + 0.5 * (wrench - self.newest.centre))
        self._missed = wrench
        others = [one for one in self._kept if one is not self.newest and one is not self._before]
        known = min(others, key=lambda one: one.distance(wrench), default=None)
        if known is not None and known.distance(wrench) < 0.5:
            self.coming = Future()
            self.coming.set_result(known)
        else:
            self.coming = self._thread.submit(self._found, centres)

    def _take_over(self, coming: Future[Interpolation | None], last: Array) -> None:
        new = None if coming.cancelled() else coming.result()
        if new is None:
            self.coming = None
            return
        if new.distance(last) >= 1.0:
            # the wrench has gone elsewhere
            self.coming = self._missed = None
            return
        known = [one for one in (self.newest, self._before) if one is not None]
        here = [one for one in known if one.distance(last) < 1.0]
        if self._before is not None and here:
            # two of them are being mixed: one after the other
            return
        self.coming = self._missed = None
        self._before, self.newest = here[0] if here else None, new
        if new not in self._kept:
            self._kept.append(new)
        fade = 0.1  # of the radius: the way over which a new one takes over
        # where no other has a weight, plans are solved, and at its centre they are the same
        self._fade = fade if here else min(fade, self._way(last, new.centre))
        self._fading = 0.0 if self._fade > 0.0 else 1.0

    def _way(self, start: Array, end: Array) -> float:
        """Return how far a wrench is from another, in radii."""
        return float(np.abs((end - start) * self._per).sum())

    def _found(self, centres: Sequence[Array]) -> Interpolation | None:
        """Return the interpolation about the first of some centres that has one, none too small."""
        cap = self._stance.cap
        try:
            for centre in centres:
                radius, found = self._radius, None
                # smaller where a wrench of the 13 has no plan, or is overloaded
                while radius >= self._radius / 16.0 and not deadline.expired():
                    found = Interpolation.about(self._stance, centre, radius) or found
                    if found is not None and (found.most <= cap or found.utilisation > cap):
                        break
                    radius /= 2.0
                if found is not None:
                    return found
        except Exception:
            log.exception("no interpolation about %s", centres[0].tolist())
        return None


def _weight(distance: float) -> float:
    """Return the weight φ of an interpolation at a distance ``Σ |t|`` from its centre."""
    return min(max((1.0 - distance) / 0.2, 0.0), 1.0)  # it falls in the outermost fifth
