"""Define exit statuses, and where commands keep their verbosity, without loading a planner."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

__all__ = ["VERBOSITY_KEY", "ExitStatus"]

VERBOSITY_KEY: Final = "crux.verbosity"
"""Key in the ``meta`` of a command's context: 1 for more output, -1 for less."""


class ExitStatus(IntEnum):
    """Exit status of a command."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    OVERLOADED = 3

    @classmethod
    def of(cls, status: str) -> ExitStatus:
        """Return the exit status of a plan's status, or of a route's."""
        match status:
            case "optimal":
                return cls.DONE
            case "overloaded" | "infeasible" | "unreachable":
                return cls.OVERLOADED
            case _:
                return cls.FAILED
