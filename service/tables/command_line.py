"""Exit statuses, and messages on standard error; imports no planner."""

from __future__ import annotations

import sys
import textwrap
from enum import IntEnum

import click

from service.tables.layout import console

__all__ = ["ExitStatus", "note"]


class ExitStatus(IntEnum):
    """Exit status of a command: done, failed, invalid input, or overloaded."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    OVERLOADED = 3

    @classmethod
    def of(cls, status: str) -> ExitStatus:
        """Return the exit status for the status of a plan, a route or a climb.

        Parameters
        ----------
        status : str
            ``optimal`` gives DONE, as does a climb (``found``, ``not_proven``); ``overloaded``,
            ``infeasible``, ``unreachable``, and climbs that are not (``none``, ``blocked``) give
            OVERLOADED; any other status gives FAILED.
        """
        match status:
            case "optimal" | "found" | "not_proven":
                return cls.DONE
            case "overloaded" | "infeasible" | "unreachable" | "none" | "blocked":
                return cls.OVERLOADED
            case _:
                return cls.FAILED


def note(message: str) -> None:
    """Print a message on standard error: one line, or words wrapped to the width of a terminal."""
    line = f"crux: {' '.join(message.split())}"
    if sys.stderr.isatty():
        width = console(stderr=True).width
        line = textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
    click.echo(line, err=True)
