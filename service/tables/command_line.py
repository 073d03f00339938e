"""Exit statuses, and messages on standard error; imports no planner."""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterable
from enum import IntEnum
from typing import TYPE_CHECKING

import click

from service.tables.layout import console, print_warnings, verbosity

if TYPE_CHECKING:
    from rich.console import Console

    from planner import Finding

__all__ = ["ExitStatus", "note", "note_doubts", "print_oddities"]


class ExitStatus(IntEnum):
    """Exit status of a command: done, failed, invalid input, or overloaded."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    OVERLOADED = 3

    @classmethod
    def of(cls, status: str, *, fails: bool = False) -> ExitStatus:
        """Return the exit status for the status of a plan, a route or a climb.

        Parameters
        ----------
        status : str
            ``optimal`` gives DONE, as does a climb (``found``, ``not_proven``); ``overloaded``,
            ``infeasible``, ``unreachable``, and climbs that are not (``none``, ``blocked``) give
            OVERLOADED; any other status gives FAILED.
        fails : bool, optional
            True for OVERLOADED in place of DONE.
        """
        match status:
            case "optimal" | "found" | "not_proven":
                return cls.OVERLOADED if fails else cls.DONE
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


def note_doubts(findings: Iterable[Finding]) -> None:
    """Print each finding that doubts a number on standard error, once."""
    for message in dict.fromkeys(each.message for each in findings if each.doubts_number):
        note(f"warning: {message}")


def print_oddities(warnings: Iterable[str], findings: Iterable[Finding], out: Console) -> None:
    """Print all warnings; with the verbosity -1, note only findings that doubt a number.

    Parameters
    ----------
    warnings : iterable of str
        Sentences, those of the findings among them.
    findings : iterable of Finding
    out : Console
        Console to print on.
    """
    if verbosity() < 0:
        note_doubts(findings)
    else:
        print_warnings(warnings, out)
