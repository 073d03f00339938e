"""Set-points for a body wrench that changes a thousand times a second, on a stance that stays.

Plans near a centre are solved in advance and interpolated (`planner.streaming.interpolation`),
which takes a small part of the time of a solve. The interpolations follow the wrench
(`planner.streaming.prefetch`). A set-point is a mixture of plans of the same body wrench w, so the
mixture is a plan, too:

    y = s ω y_i(w) + (1 − s ω) y*(w)

with the interpolated loads y_i and their weight ω, and the plan y* that is solved for w alone where
s ω is below 1. The factor s falls from 1 to 0 where the utilisation approaches the cap: there, and
beyond, an interpolation does not show whether a plan is ``optimal``. All weights change
continuously with the wrench, so set-points do.
"""

from __future__ import annotations

import threading
from concurrent.futures import wait
from typing import Self

from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, check_positive, finite_vector
from hand_models.hand import FINGERS
from planner.programs import CAP_SLACK
from planner.question import Question, checked_body_wrench
from planner.result import SetPoints, SetPointSource
from planner.streaming.interpolation import Interpolation
from planner.streaming.prefetch import Mixture, Prefetch
from planner.streaming.stream_stance import LoadEffects, StreamStance, SupportBound

__all__ = ["WrenchStream"]


class WrenchStream:
    """Set-points of a stance for one body wrench after another, at controller rate; thread-safe.

    A context manager: leaving it closes the stream.

    Parameters
    ----------
    question : Question
        The stance, with fixed wrists, and its limits. Its body wrench, or its load, is the first
        centre of interpolation. Extras and the deadline are ignored.
    radius : float, optional
        Radius of an interpolation along a force [N]; along a moment a tenth of that [N·m]. Smaller
        near the boundary of the feasible wrenches.

    Attributes
    ----------
    question : Question
    radius : float

    Raises
    ------
    InvalidInputError
        If the question is not valid; an `UnsupportedError` if it has a wrist that is not fixed, an
        objective other than ``max_margin``, or a limit on the change of tensions.
    """

    def __init__(self, question: Question, *, radius: float = 30.0) -> None:
        check_positive(radius, "N", "radius", 1e4)
        self.radius = float(radius)
        self.question = question
        self._stance = StreamStance(question)
        self._following = Prefetch(self._stance, self.radius)
        self._lock = threading.Lock()
        self._proofs: list[SupportBound] = []
        self._last: SetPoints | None = None
        self._closed = False
        self._key = b""
        """The wrench of the last set-points."""

    @property
    def limbs(self) -> tuple[str, ...]:
        """Limbs of the hands, in the order of all arrays."""
        return self._stance.limbs

    @property
    def columns(self) -> tuple[tuple[str, ...], ...]:
        """Names of each hand's loads, in the order of `SetPoints.loads`."""
        return self._stance.columns

    @property
    def first(self) -> Array:
        """Body wrench of the first interpolation's centre, in B, shape (6,) [N, N·m]."""
        return self._stance.first

    @property
    def newest(self) -> Interpolation | None:
        """The newest interpolation; None if none was found yet."""
        with self._lock:
            return self._following.newest

    @property
    def interpolates(self) -> float | None:
        """Radius of the newest interpolation [N]; None if none was found yet."""
        newest = self.newest
        return None if newest is None else newest.radius

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the stream: end its thread; further calls of `set_points` raise an error."""
        with self._lock:
            self._closed = True
            thread = self._following.close()
        if thread is not None:
            thread.shutdown(wait=True, cancel_futures=True)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the interpolation that is being solved is ready; False on timeout.

        Parameters
        ----------
        timeout : float, optional
            Longest time to wait [s]; unlimited by default.

        Returns
        -------
        bool
            True if the interpolation is ready, or none is being solved.
        """
        with self._lock:
            coming = self._following.coming
        return coming is None or not wait([coming], timeout).not_done

    def set_points(self, body_wrench: ArrayLike) -> SetPoints:
        """Return the set-points for a body wrench: tensions, winch angles, motor currents.

        Parameters
        ----------
        body_wrench : array_like, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].

        Raises
        ------
        InvalidInputError
            If the wrench is not six finite numbers, or too large to be plausible, or if the stream
            is closed.
        """
        # a copy: callers may well fill their own array again
        wrench = checked_body_wrench(
            finite_vector(body_wrench, 6, "body_wrench"), "body_wrench"
        ).copy()
        key = wrench.tobytes()
        with self._lock:
            if self._closed:
                raise InvalidInputError("is closed; open another", field="stream")
            if self._last is not None:
                if self._last.verified and self._key == key:
                    return self._last
                self._following.go(self._last.body_wrench, wrench)
            mixture = self._following.mixture(wrench)
            self._last, self._key = self._found(wrench, mixture), key
            self._following.look_ahead(wrench, mixture.distance)
            return self._last

    def _found(self, wrench: Array, mixture: Mixture) -> SetPoints:
        """Return the set-points: from interpolations as far as these go, the rest solved."""
        share, loads, bound, _ = mixture
        if share > 0.0:
            read = self._stance.read(loads)
            # up to 0.01 below the cap plans are solved one by one
            share *= min(max((self._stance.cap - read.utilisation) / 0.01, 0.0), 1.0)
            if share >= 1.0:
                points = self._told(wrench, loads, read, bound, "interpolated")
                if points.verified:
                    return points
                share = 0.0
        solved = self._stance.solve(wrench)
        if solved is None:
            return self._without(wrench)
        if share > 0.0:
            loads = share * loads + (1.0 - share) * solved.loads
            read, bound = self._stance.read(loads), max(bound, solved.bound)
            points = self._told(wrench, loads, read, bound, "blended")
            if points.verified:
                return points
        read = self._stance.read(solved.loads)
        points = self._told(wrench, solved.loads, read, solved.bound, "solved")
        return points if points.verified else self._without(wrench)

    def _told(
        self, wrench: Array, loads: Array, read: LoadEffects, bound: float, source: SetPointSource
    ) -> SetPoints:
        """Return loads, and what they do, as set-points, checked."""
        stance, check = self._stance, self._stance.check
        wrenches, utilisation = read
        tensions = loads[:, : len(FINGERS)]
        used = float(max(utilisation, check.idle))
        return SetPoints(
            status="optimal" if used <= stance.cap + CAP_SLACK else "overloaded",
            body_wrench=wrench,
            utilisation=used,
            gap=float(max(used - max(bound, check.idle), 0.0)),
            tensions=tensions,
            wrenches=wrenches,
            loads=loads,
            verified=check.fault(loads, wrenches, used, wrench) is None,
            source=source,
            winch_angle=stance.winches[0] + stance.winches[1] * tensions,
            motor_torque=stance.drive.torque(tensions),
            motor_current=stance.drive.current(tensions),
        )

    def _without(self, wrench: Array) -> SetPoints:
        """Return what a whole plan says of a wrench that the solver has no plan for."""
        for proof in self._proofs:
            if float(proof.direction @ wrench) > proof.most:
                known = "a proof that is known shows that no plan balances the body"
                return SetPoints("infeasible", wrench, verified=True, reason=known)
        plan = self._stance.known.plan(wrench)
        if plan.hands is not None and plan.utilisation is not None:
            # of the nearest wrench that can be had: a hair off, by rounding
            loads = self._stance.loads_of(plan)
            read = self._stance.read(loads)
            points = self._told(wrench, loads, read, plan.utilisation, "solved")
            if points.verified:
                return points
        found = self._stance.proof(plan)
        if plan.status == "infeasible" and found is not None:
            self._proofs = [found, *self._proofs][:8]  # those found last
            return SetPoints("infeasible", wrench, verified=True, reason=plan.reason)
        return SetPoints("failed", wrench, verified=False, reason=plan.reason)
