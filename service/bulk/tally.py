"""Count the answers of bulk work as they come, by status and by kind of error."""

from __future__ import annotations

import statistics
from array import array
from collections import Counter, defaultdict

from service.replies import ErrorDetail
from service.wire import REQUEST_KINDS

__all__ = ["Tally"]


class Tally:
    """Counts of answers.

    Attributes
    ----------
    count : int
    statuses, kinds : Counter of str
        Plans by status, errors by kind.
    times : dict of str to array of float
        How long plans have taken, by status [s].
    bad, first_bad : int, (int, ErrorDetail) or None
        Errors that are their requests' fault; the index and error of the first.
    further_bad : list of int
        Indices of those after the first, five at most.
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
        """Count an answer: a plan's status, or an error."""
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
        """Return the median and the longest of the times of a status, or of all [s]."""
        times = [t for key, each in self.times.items() if status in (None, key) for t in each]
        return (statistics.median(times), max(times)) if times else (None, None)

    @property
    def errors(self) -> str:
        """Errors by kind, in words; empty where there are none."""
        return ", ".join(f"{count} {kind}" for kind, count in sorted(self.kinds.items()))
