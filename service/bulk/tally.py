"""Count the answers of a bulk run, by status and by kind of error."""

from __future__ import annotations

import statistics
from array import array
from collections import Counter, defaultdict

from service.replies import ErrorDetail
from service.wire import REQUEST_KINDS

__all__ = ["Tally"]


class Tally:
    """Counts and times of the answers of a bulk run.

    Attributes
    ----------
    count : int
        Number of all answers.
    statuses : Counter of str
        Number of plans by status.
    kinds : Counter of str
        Number of errors by kind.
    times : dict of str to array of float
        Times that plans took, by status [s].
    bad : int
        Number of errors whose cause is the request.
    first_bad : tuple of (int, ErrorDetail), or None
        Index of the first request with such an error, and the error.
    further_bad : list of int
        Indices of the next requests with such errors, at most five.
    """

    def __init__(self) -> None:
        self.count = self.bad = 0
        self.statuses: Counter[str] = Counter()
        self.kinds: Counter[str] = Counter()
        self.times: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))
        self.first_bad: tuple[int, ErrorDetail] | None = None
        self.further_bad: list[int] = []

    def add(
        self, status: str | None, error: ErrorDetail | None = None, seconds: float | None = None
    ) -> None:
        """Count one answer: a plan, or an error.

        Parameters
        ----------
        status : str or None
            Status of the plan; ignored for an error.
        error : ErrorDetail, optional
            The error; None for a plan.
        seconds : float, optional
            Time that the plan took [s]; not counted if it is None.
        """
        if error is not None:
            self.kinds[error.kind] += 1
            if error.kind in REQUEST_KINDS:
                self.bad += 1
                if self.first_bad is None:
                    self.first_bad = self.count, error
                elif len(self.further_bad) < 5:
                    self.further_bad.append(self.count)
        elif status is not None:
            self.statuses[status] += 1
            if seconds is not None:
                self.times[status].append(seconds)
        self.count += 1

    def middle_and_longest(self, status: str | None = None) -> tuple[float | None, float | None]:
        """Return the median and the maximum of the times that plans took.

        Parameters
        ----------
        status : str, optional
            Status of the plans that count; by default all plans.

        Returns
        -------
        median : float or None
            Median time [s]; None if no time is known.
        longest : float or None
            Maximum time [s]; None if no time is known.
        """
        times = [t for key, each in self.times.items() if status in (None, key) for t in each]
        return (statistics.median(times), max(times)) if times else (None, None)

    @property
    def errors(self) -> str:
        """Number of errors of each kind as text, such as ``2 invalid, 1 lost``; empty for none."""
        return ", ".join(f"{count} {kind}" for kind, count in sorted(self.kinds.items()))
