"""Print results and progress of commands, draw pictures, and return exit statuses."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Protocol

import click
import msgspec

import planner
from hand_models.base import CruxError, InvalidInputError
from service import answering, replies
from service.requests import PlanRequest
from service.tables.command_line import VERBOSITY_KEY, ExitStatus
from service.tables.layout import console

__all__ = [
    "filling_folder",
    "note",
    "progress",
    "remark",
    "say",
    "show",
    "tell_solver",
    "verbosity",
    "waiting",
    "working",
    "write_plan_picture",
    "writing",
]


def verbosity() -> int:
    """Return the verbosity: 1 for more output than by default (0), -1 for less."""
    context = click.get_current_context(silent=True)
    level: int = 0 if context is None else context.meta.get(VERBOSITY_KEY, 0)
    return level


def remark(message: str) -> None:
    """Write one line on standard error, unless verbosity is -1."""
    if verbosity() >= 0:
        note(message)


def note(message: str) -> None:
    """Write one line on standard error."""
    click.echo(f"crux: {' '.join(message.split())}", err=True)


def say(result: object) -> None:
    """Write a result as one line of JSON."""
    click.echo(msgspec.json.encode(result))


def show(reply: replies.PlanReply | replies.BriefPlanReply, as_json: bool) -> int:
    """Write a plan, and return its exit status; a brief reply is written as JSON."""
    from service.tables.extras import print_advice
    from service.tables.plans import print_plan

    if as_json or isinstance(reply, replies.BriefPlanReply):
        say(reply)
    else:
        print_plan(reply, console(), brief=verbosity() < 0)
        if verbosity() >= 0:
            print_advice(reply, console())
        tell_solver(reply)
    return ExitStatus.of(reply.status)


def tell_solver(reply: replies.PlanReply) -> None:
    """Write how a plan was found, if verbosity is 1."""
    if verbosity() > 0:
        solver, time = reply.solver, reply.time
        note(
            f"{solver.name}: {solver.status} after {solver.iterations} iterations; "
            f"model {1e3 * time.model:.1f} ms, solve {1e3 * time.solve:.1f} ms, "
            f"in all {1e3 * time.total:.1f} ms"
        )


def write_plan_picture(answer: answering.Planned, picture: Path) -> None:
    """Draw a plan in its stance."""
    with writing(picture):
        planner.plot_plan(answer.plan, answer.question, picture)


@contextmanager
def writing(path: Path, field: str = "--plot") -> Iterator[None]:
    """Turn an error in writing a file into one line that names the option if it is at fault."""
    try:
        yield
    except OSError as error:
        raise _unwritten(error, path, field) from None
    except ValueError as error:
        raise InvalidInputError(f"cannot write {path}: {error}", field=field) from None


@contextmanager
def filling_folder() -> Iterator[None]:
    """Turn an error in writing a folder into one line about it."""
    try:
        yield
    except OSError as error:
        raise _unwritten(error, error.filename, "DIR") from None


def _unwritten(error: OSError, path: Path | str | None, field: str) -> CruxError:
    """Return the error of a file that cannot be written: bad input, unless the disk is full."""
    message = f"cannot write {path}: {error.strerror or error}"
    # the file's name is not to blame
    if error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}:
        return CruxError(message)
    return InvalidInputError(message, field=field)


class Progress(Protocol):
    """Function that takes the work done, the total, and optionally a few words."""

    def __call__(self, done: int, total: int, words: str = "") -> None: ...


@contextmanager
def progress(title: str, *, line: str | None = None, counted: bool = False) -> Iterator[Progress]:
    """Show a bar on standard error while the work lasts; yield the function that updates it.

    Parameters
    ----------
    title : str
    line : str, optional
        Written at the first step, where no bar can be shown.
    counted : bool, optional
        True if counts, the time left and words are also shown.
    """
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description}", markup=False),
        bars.BarColumn(),
        bars.MofNCompleteColumn() if counted else bars.TaskProgressColumn(),
        bars.TimeRemainingColumn(),
        bars.TextColumn("{task.fields[words]}", markup=False),
    )
    screen = console(stderr=True)
    shown = screen.is_terminal and verbosity() >= 0
    lines = [line] if line is not None and not screen.is_terminal else []
    bar = bars.Progress(*columns, console=screen, transient=True, disable=not shown)
    # before rich 14.3 a bar that is not shown leaves an empty line behind
    with bar if shown else nullcontext():
        task = bar.add_task(title, total=None, words="")

        def step(done: int, total: int, words: str = "") -> None:
            if lines:
                remark(lines.pop())
            bar.update(task, completed=done, total=total, words=words)

        yield step


def waiting(title: str, request: PlanRequest) -> AbstractContextManager[None]:
    """Show that an answer takes a while, as plans with wrists that give way do."""
    floats = any(hand.wrist != "fixed" for hand in request.stance.hands)
    return working(title) if floats else nullcontext()


@contextmanager
def working(title: str) -> Iterator[None]:
    """Show on a terminal's standard error what is being done, unless verbosity is -1."""
    screen = console(stderr=True)
    shown = screen.is_terminal and verbosity() >= 0
    with screen.status(title) if shown else nullcontext():
        yield
