"""Write results and progress of commands to the terminal, and convert errors of writing files."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Protocol

import click
import msgspec

import planner
from hand_models.base import CruxError, InvalidInputError
from service import answering, replies
from service.requests import PlanRequest
from service.tables.command_line import ExitStatus, note
from service.tables.layout import console, verbosity

__all__ = [
    "filling_folder",
    "progress",
    "remark",
    "say",
    "show",
    "tell_solver",
    "waiting",
    "working",
    "write_plan_picture",
    "writing",
]


def remark(message: str) -> None:
    """Print a message on standard error, unless the verbosity is -1."""
    if verbosity() >= 0:
        note(message)


def say(result: object) -> None:
    """Print a result on standard output as one line of JSON."""
    click.echo(msgspec.json.encode(result))


def show(reply: replies.PlanReply | replies.BriefPlanReply, as_json: bool) -> int:
    """Print a plan as tables or as JSON, and return the exit status of the command.

    Parameters
    ----------
    reply : PlanReply or BriefPlanReply
        The plan; a brief reply is always printed as JSON.
    as_json : bool
        True to print JSON.

    Returns
    -------
    int
        An `ExitStatus`, from the status of the plan.
    """
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
    """Print solver, iterations and times of a plan on standard error, if the verbosity is 1."""
    if verbosity() > 0:
        solver, time = reply.solver, reply.time
        note(
            f"{solver.name}: {solver.status} after {solver.iterations} iterations; "
            f"model {1e3 * time.model:.1f} ms, solve {1e3 * time.solve:.1f} ms, "
            f"in all {1e3 * time.total:.1f} ms"
        )


def write_plan_picture(answer: answering.Planned, picture: Path) -> None:
    """Plot the stance and the plan of an answer to a file.

    Parameters
    ----------
    answer : Planned
        Question and plan.
    picture : Path
        File to write; its ending names the format.

    Raises
    ------
    InvalidInputError
        If the file cannot be written.
    CruxError
        If the disk is full or fails.
    """
    with writing(picture):
        planner.plot_plan(answer.plan, answer.question, picture)


def write_answer_page(
    answer: answering.Planned, page: Path, title: str, sure: Sequence[str] = ()
) -> None:
    """Write the stance and the plan of an answer as a page; raise as `write_plan_picture`.

    Parameters
    ----------
    answer : Planned
        Question and plan.
    page : Path
        File of HTML to write.
    title : str
        Title of the page.
    sure : sequence of str, optional
        Sentences that say how sure the plan is.
    """
    with writing(page, "--html"):
        planner.write_plan_page(answer.plan, answer.question, page, title, sure)


@contextmanager
def writing(path: Path, field: str = "--plot") -> Iterator[None]:
    """Convert errors of writing a file, within this context, into errors of one line.

    Parameters
    ----------
    path : Path
        File that is written.
    field : str, optional
        Option of the command that names the file.

    Raises
    ------
    InvalidInputError
        If the file cannot be written.
    CruxError
        If the disk is full or fails.
    """
    try:
        yield
    except OSError as error:
        raise _unwritten(error, path, field) from None
    except ValueError as error:
        raise InvalidInputError(f"cannot write {path}: {error}", field=field) from None


@contextmanager
def filling_folder() -> Iterator[None]:
    """Convert errors of writing into a folder, within this context, into errors of one line.

    Raises
    ------
    InvalidInputError
        If a file cannot be written.
    CruxError
        If the disk is full or fails.
    """
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
    """Protocol of a function that shows progress, from work done, total and optional words."""

    def __call__(self, done: int, total: int, words: str = "") -> None: ...


@contextmanager
def progress(title: str, *, line: str | None = None, counted: bool = False) -> Iterator[Progress]:
    """Show a progress bar on standard error, within this context.

    Parameters
    ----------
    title : str
        Text before the bar.
    line : str, optional
        Text to print once, at the first step, if standard error is no terminal.
    counted : bool, optional
        True to show counts in place of percentages.

    Yields
    ------
    Progress
        Function that updates the bar.
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
    """Show a title on the terminal while a plan with floating or compliant wrists is computed.

    Parameters
    ----------
    title : str
        Text to show.
    request : PlanRequest
        Request that is answered; nothing is shown if all its wrists are fixed.
    """
    floats = any(hand.wrist != "fixed" for hand in request.stance.hands)
    return working(title) if floats else nullcontext()


@contextmanager
def working(title: str) -> Iterator[None]:
    """Show a title on the terminal within this context, unless the verbosity is -1."""
    screen = console(stderr=True)
    shown = screen.is_terminal and verbosity() >= 0
    with screen.status(title) if shown else nullcontext():
        yield
