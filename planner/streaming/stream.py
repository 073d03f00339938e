"""Set-points for a body wrench that changes, on a stance that stays.

With fixed wrists plans are interpolated (`planner.streaming.interpolated_points`), a thousand times
a second. The sets of compliant wrists are curved, so that a mixture of plans is none: each
set-point is solved, beginning at the last (`planner.streaming.compliant_points`). After tiles have
slipped, set-points are solved without them (`planner.recovery`).
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import wait
from dataclasses import fields, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import (
    Array,
    InvalidInputError,
    UnsupportedError,
    check_positive,
    finite_vector,
)
from planner.question import LostTile, Question, checked_body_wrench
from planner.result import SetPoints
from planner.scene import WrenchCheck, wrench_findings
from planner.solving import MaxMargin, objective_of
from planner.streaming.answered_points import PointsAfterSlips
from planner.streaming.compliant_points import CompliantPoints
from planner.streaming.interpolated_points import InterpolatedPoints
from planner.streaming.interpolation import Interpolation

__all__ = ["WrenchStream"]


class WrenchStream:
    """Set-points of a stance for one body wrench after another, at controller rate; thread-safe.

    A context manager: leaving it closes the stream.

    Parameters
    ----------
    question : Question
        The stance, with fixed or compliant wrists, and its limits. Its body wrench, or its load, is
        the first centre of interpolation, or the first that is solved. Extras and the deadline are
        ignored.
    radius : float, optional
        Radius of an interpolation along a force [N]; along a moment a tenth of that [N·m]. Smaller
        near the boundary of the feasible wrenches. Without meaning for compliant wrists.
    lost : sequence of LostTile, optional
        Tiles that have slipped before, beside those of each call; fixed wrists only.

    Attributes
    ----------
    question : Question
    radius : float
    findings : tuple of Finding
        Findings about the stance, the numbers of its question and its first body wrench.

    Raises
    ------
    InvalidInputError
        If the question is not valid; an `UnsupportedError` if it has a floating wrist, an
        objective other than ``max_margin``, or a limit on the change of tensions.
    """

    def __init__(
        self, question: Question, *, radius: float = 30.0, lost: Sequence[LostTile] = ()
    ) -> None:
        check_positive(radius, "N", "radius", 1e4)
        self.radius = float(radius)
        self.question = question
        _refuse(question)
        question = replace(question.bare(), present={})
        self._source: InterpolatedPoints | CompliantPoints
        if any(hand.wrist == "compliant" for hand in question.stance.hands):
            self._source = CompliantPoints(question)
        else:
            self._source = InterpolatedPoints(question, self.radius)
        self._odd = WrenchCheck(question)
        self._lock = threading.Lock()
        self._last: SetPoints | None = None
        self._closed = False
        self._key: tuple[bytes, tuple[LostTile, ...]] = b"", ()
        """The wrench of the last set-points, and the tiles that had slipped."""
        self._lost = tuple(lost)
        self._slips: PointsAfterSlips | UnsupportedError
        try:
            self.findings = (*self._source.findings, *wrench_findings(question))
            self._slips = self._source.after_slips()
        except UnsupportedError as refused:
            self._slips = refused
        except BaseException:
            self.close()
            raise

    @property
    def limbs(self) -> tuple[str, ...]:
        """Limbs of the hands, in the order of all arrays."""
        return self._source.limbs

    @property
    def columns(self) -> tuple[tuple[str, ...], ...]:
        """Names of each hand's loads, in the order of `SetPoints.loads`."""
        return self._source.columns

    @property
    def first(self) -> Array:
        """Body wrench of the question, in B, shape (6,) [N, N·m]."""
        return self._source.first

    @property
    def newest(self) -> Interpolation | None:
        """The newest interpolation; None if none was found yet, or wrists are compliant."""
        with self._lock:
            return self._source.newest

    @property
    def interpolates(self) -> float | None:
        """Radius of the newest interpolation [N]; None without one."""
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
            thread = self._source.close()
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
            coming = self._source.coming
        return coming is None or not wait([coming], timeout).not_done

    def set_points(self, body_wrench: ArrayLike, lost: Sequence[LostTile] = ()) -> SetPoints:
        """Return the set-points for a body wrench: tensions, winch angles, poses of wrists.

        Parameters
        ----------
        body_wrench : array_like, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        lost : sequence of LostTile, optional
            Tiles that have slipped, and all that had slipped before: the set-points do without
            them. They are solved for this wrench.

        Raises
        ------
        InvalidInputError
            If the wrench is not six finite numbers, or too large to be plausible, if a lost tile
            is not on the rock in this stance, or if the stream is closed.
        UnsupportedError
            If tiles are lost of a stance that does not support it.
        """
        # a copy: callers may well fill their own array again
        wrench = checked_body_wrench(
            finite_vector(body_wrench, 6, "body_wrench"), "body_wrench"
        ).copy()
        lost = tuple(dict.fromkeys((*self._lost, *lost)))
        key = wrench.tobytes(), lost
        with self._lock:
            if self._closed:
                raise InvalidInputError("is closed; open another stream", field="stream")
            last = self._last
            if last is not None and last.verified and self._key == key:
                return last
            if not lost:
                found = self._source.find(wrench)
            elif isinstance(self._slips, UnsupportedError):
                raise self._slips
            else:
                found = self._slips.find(wrench, lost)
            if odd := self._odd.findings(wrench):
                found = replace(found, findings=odd)
            self._last, self._key = _frozen(found), key
            return found


def _refuse(question: Question) -> None:
    """Refuse what a stream does not do."""
    for i, hand in enumerate(question.stance.hands):
        if hand.wrist == "floating":
            raise UnsupportedError(
                f"{hand.wrist} is not available for streams; valid is fixed or compliant",
                field=f"stance.hands[{i}].wrist",
            )
    objective = objective_of(question)
    if not isinstance(objective, MaxMargin):
        raise UnsupportedError(
            f"{objective.name} is not available for streams; valid is {MaxMargin.name}",
            field="objective",
        )
    if question.limits.margins != "required":
        raise UnsupportedError(
            f"{question.limits.margins} is not available for streams, which have no time to find "
            "what can be kept; valid is required: leave it out, and give the margins",
            field="limits.margins",
        )
    if question.limits.tension_change is not None:
        raise UnsupportedError(
            "not available for streams, whose tensions change with the wrench: leave it out",
            field="limits.tension_change",
        )


def _frozen(points: SetPoints) -> SetPoints:
    """Return set-points whose arrays are read-only: they are returned again for an equal wrench."""
    for part in (points, *(points.wrists or ())):
        for field in () if part is None else fields(part):
            if isinstance(each := getattr(part, field.name), np.ndarray):
                each.flags.writeable = False
    return points
