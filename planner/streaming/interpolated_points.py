"""Set-points of fixed wrists: interpolated between plans that are known, the rest solved.

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

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.programs import CAP_SLACK
from planner.question import Question
from planner.result import Finding, SetPoints, SetPointSource
from planner.streaming.answered_points import PointsAfterSlips
from planner.streaming.interpolation import Interpolation
from planner.streaming.prefetch import Mixture, Prefetch
from planner.streaming.stream_stance import LoadEffects, Solved, StreamStance, SupportBound

__all__ = ["InterpolatedPoints"]


class InterpolatedPoints:
    """Set-points of a stance with fixed wrists. Not thread-safe: `WrenchStream` has a lock.

    Parameters
    ----------
    question : Question
        The stance, with fixed wrists, and its limits.
    radius : float
        Radius of an interpolation along a force [N].
    """

    def __init__(self, question: Question, radius: float) -> None:
        self._stance = StreamStance(question)
        self._following = Prefetch(self._stance, radius)
        self._proofs: list[SupportBound] = []
        self._near: Solved | None = None
        """The plan that was solved last."""
        self._last: Array | None = None
        """Body wrench of the last set-points."""

    @property
    def limbs(self) -> tuple[str, ...]:
        """Limbs of the hands, in the order of all arrays."""
        return self._stance.limbs

    @property
    def columns(self) -> tuple[tuple[str, ...], ...]:
        """Names of each hand's loads."""
        return self._stance.columns

    @property
    def first(self) -> Array:
        """Body wrench of the question, in B, shape (6,) [N, N·m]."""
        return self._stance.first

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the stance and the numbers of its question."""
        return self._stance.known.findings

    @property
    def newest(self) -> Interpolation | None:
        """The newest interpolation; None if none was found yet."""
        return self._following.newest

    @property
    def coming(self) -> Future[Interpolation | None] | None:
        """The next interpolation, which a thread is solving."""
        return self._following.coming

    def close(self) -> ThreadPoolExecutor | None:
        """Stop solving interpolations; return the thread pool, for the caller to shut down."""
        return self._following.close()

    def after_slips(self) -> PointsAfterSlips:
        """Return the source of set-points after tiles have slipped.

        Raises
        ------
        UnsupportedError
            If a part of the stance is not supported after slips.
        """
        points = PointsAfterSlips(self._stance.known.prepared)
        # a plan without more tiles starts from that without one
        for tile in points.tiles:
            self._following.submit(points.find, self._stance.first, [tile])
        self._following.submit(points.look_ahead)
        return points

    def find(self, wrench: Array) -> SetPoints:
        """Return the set-points for a body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        if self._last is not None:
            self._following.go(self._last, wrench)
        mixture = self._following.mixture(wrench)
        points, self._last = self._found(wrench, mixture), wrench
        self._following.look_ahead(wrench, mixture.distance)
        return points

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
        solved = self._near = self._stance.solve(wrench, self._near)
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
        if not points.verified:
            return self._without(wrench)
        if points.status == "overloaded":
            points = replace(points, reason=self._stance.overload(wrench))
        return points

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
