"""How much a search may still compute: a count of programs, the same on every machine.

A deadline, where there is one, ends every budget.
"""

from __future__ import annotations

from planner.deadline import clock

__all__ = ["Budget"]


class Budget:
    """A count of programs that may still be solved.

    A search asks before each step whether it has ended, so that the last step may overdraw it.

    Parameters
    ----------
    programs : int
    whole : Budget, optional
        Of which this one is a part: what is spent here is spent there.
    """

    def __init__(self, programs: int, whole: Budget | None = None) -> None:
        self._left = programs
        self._whole = whole

    @property
    def ended(self) -> bool:
        """Whether nothing is left, here or of the whole, or the time is over."""
        if self._left <= 0 or clock.expired():
            return True
        return self._whole is not None and self._whole.ended

    def spend(self, programs: int = 1) -> None:
        """Take some programs off."""
        self._left -= programs
        if self._whole is not None:
            self._whole.spend(programs)

    def part(self, programs: int) -> Budget:
        """Return a part of this budget."""
        return Budget(programs, self)
