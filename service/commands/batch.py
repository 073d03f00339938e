"""Define ``crux batch``: answer many plan requests from a file of JSON lines."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, nullcontext
from functools import partial
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

import planner
from hand_models.base import CruxError, InvalidInputError
from service import bulk, processes, tables, wire
from service.commands import options
from service.commands.declaring import argument, command, flag, option

if TYPE_CHECKING:
    from service.climbs import Listing

__all__ = [
    "LISTED_ENDINGS",
    "answer_rest",
    "batch_command",
    "complain",
    "exit_status",
    "is_listed",
    "writing_answers",
]

LISTED_ENDINGS: Final = ".jsonl or .csv or .parquet"


@command("batch")
def batch_command(
    requests: str = argument(),
    file: Path | None = option(
        "Where the answers go: FILE.csv and FILE.parquet are tables, any other file "
        "has the replies, one a line.",
        options.ANY_PATH,
        usage="-o --output FILE",
    ),
    columns: str | None = option(
        "Of a table: names with commas between, * in them.", usage="NAMES"
    ),
    resume: bool = flag(
        "Go on where a batch that was broken off ended: what FILE answers is not asked again."
    ),
    export: bool = flag("Write the table of what a batch has answered so far, and ask nothing."),
    parallel: options.WorkersOption = options.workers_options,
    explain: bool | None = option(
        "Whether it is proven and named what is in the way where a stance is overloaded or "
        "infeasible. By default replies do as their requests say, and tables leave it out.",
        usage="--explain/--no-explain",
        default=None,
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Answer many plan requests: one a line in, one reply, row or error out, in order.

    REQUESTS is the path of a file of JSON lines, or - for standard input; blank lines are skipped.
    Lines are requests as the service takes them. Each has its own extras, and the numbers of --hand
    where its stance gives none. Meshes may be in files, by paths relative to the file of lines;
    each is read once. With --json the replies are written on standard output, or with -o a summary.

    Exit status: the worst of what the requests alone would have: 1 where one failed or was lost, or
    else 2 where one is bad input, or else 3 where one is overloaded or infeasible.
    """
    if resume and file is None:
        raise InvalidInputError("requires -o FILE, the output to resume", field="--resume")
    is_table = file is not None and bulk.exporter_at(file) is not None
    for given, name in ((columns is not None, "--columns"), (export, "--export")):
        if given and not is_table:
            raise InvalidInputError("requires a table: -o FILE.csv or FILE.parquet", field=name)
    if file is not None:
        _check_output(file, requests, resume, is_table)
        tables.write_alone(file)
    begun = perf_counter()
    with closing(bulk.Lines(requests)) as lines:
        explain = bool(explain) if is_table else explain
        kept = resume or export
        sink: bulk.Run
        with writing_answers(file):
            if file is not None and is_table:
                chosen = _columns(columns, own.robot, bool(explain))
                header = bulk.new_header(chosen, bool(explain), *own)
                sink = bulk.TableLines(file, chosen, header, kept, lines)
            else:
                sink = bulk.ReplyLines(file, as_json, kept, lines)
        before = sink.tally.count
        on, workers = parallel.place(lines.count - before)
        answers = partial(
            bulk.answer_all,
            on=on,
            workers=workers,
            hand=own.hand,
            robot=own.robot,
            folder=Path() if requests == "-" else Path(requests).parent,
            explain=explain,
            brief=is_table,
        )
        if export and isinstance(sink, bulk.TableLines):
            if not before:
                raise InvalidInputError(
                    f"{sink.file} has no answers of these requests; answer some first",
                    field="--export",
                )
            with writing_answers(file):
                sink.export()
        else:
            answer_rest(lines, answers, sink, file, f"planning {requests}", "requests")
        elapsed = perf_counter() - begun
        complain(sink.tally, lambda index: f"line {lines.number(index)}", "lines")
    if not as_json:
        _print(sink.tally, before, elapsed, file)
    elif file is not None:
        tables.say(_summary(sink.tally, elapsed) | {"file": str(file)})
    return exit_status(sink.tally)


def writing_answers(file: Path | None) -> AbstractContextManager[None]:
    """Return a context manager that turns errors of writing answers into one line about ``-o``.

    Parameters
    ----------
    file : Path or None
        File of the answers; with None errors are left as they are.
    """
    return nullcontext() if file is None else tables.writing(file, "-o")


def answer_rest(
    asked: bulk.Asked,
    answers: Callable[[Iterator[Any]], Generator[wire.Answer, None, None]],
    sink: bulk.Run,
    file: Path | None,
    title: str,
    noun: str,
) -> None:
    """Answer the questions that a run has no answers for yet, and show the progress.

    Parameters
    ----------
    asked : Asked
        All questions, also those that are already answered.
    answers : callable
        Takes an iterator of questions; returns a generator of their answers in order.
    sink : Run
        Stores each answer at once.
    file : Path or None
        File of the answers, for messages.
    title : str
        Description of the work, for the progress bar.
    noun : str
        Plural name of the questions, for messages.

    Raises
    ------
    Interrupted, CruxError
        If a signal or an error ends the work early; the message says which answers are kept.
    """
    begun, before = perf_counter(), sink.tally.count
    due: deque[bytes] = deque()

    def ask() -> Iterator[bulk.Question]:
        # the answers start here: until now an earlier file was kept
        open_sink()
        for question in islice(asked.questions(), before, None):
            due.append(question.payload if isinstance(question, wire.Answer) else question)
            yield question

    opened = False

    def open_sink() -> None:
        nonlocal opened
        opened = True
        stack.enter_context(sink.open())

    def kept() -> str:
        known = f"{sink.tally.count} of {asked.count} {noun} are answered"
        if sink.file is None or file is None:
            return known
        if not opened and (file.exists() or sink.file.exists()):
            return known
        return f"{known} in {sink.file}; --resume goes on"

    try:
        with ExitStack() as stack:
            report = stack.enter_context(tables.progress(title, counted=True))
            stack.enter_context(writing_answers(file))
            found = stack.enter_context(closing(answers(ask())))
            if before == asked.count:
                open_sink()
            report(before, asked.count, "")
            for answer in found if before < asked.count else ():
                sink.write(due.popleft(), answer.payload, answer.seconds)
                done = sink.tally.count
                rate = (done - before) / (perf_counter() - begun)
                words = ", ".join(filter(None, (f"{rate:.0f}/s", sink.tally.errors)))
                report(done, asked.count, words)
    except processes.Interrupted:
        raise processes.Interrupted(kept()) from None
    except InvalidInputError:
        raise
    except CruxError as error:
        raise CruxError(f"{error.message}; {kept()}") from None


def _check_output(file: Path, requests: str, resume: bool, is_table: bool) -> None:
    """Refuse a file for answers that is the requests' own, or that nothing can be resumed in."""
    try:
        if not is_table and file.is_dir():
            field = "--resume" if resume else "-o"
            raise InvalidInputError(f"{file}: is a folder; give a file", field=field)
        if resume and not is_table and file.exists() and not file.is_file():
            raise InvalidInputError(
                f"{file}: not a file, so it has nothing to resume; leave out --resume",
                field="--resume",
            )
        given = os.fstat(sys.stdin.fileno()) if requests == "-" else os.stat(requests)
        if file.is_file() and os.path.samestat(file.stat(), given):
            raise InvalidInputError(
                f"{file}: is the file of the requests; give another output", field="-o"
            )
    except OSError:
        # reading or writing reports it
        return


def _columns(
    wanted: str | None, robot: planner.RobotFile | None, explained: bool
) -> tuple[bulk.Column, ...]:
    """Return the columns of a table about a robot."""
    limbs = (planner.RobotFile.bundled() if robot is None else robot).limbs
    try:
        return bulk.chosen_columns(wanted, limbs, explained)
    except InvalidInputError as error:
        raise InvalidInputError(error.message, field="--columns") from None


def complain(tally: bulk.Tally, where: Callable[[int], str], noun: str) -> None:
    """Print the first question that is bad input, the number of such questions, and where more are.

    Parameters
    ----------
    tally : Tally
        Counts of all answers.
    where : callable
        Returns the name of the question with an index, such as its line.
    noun : str
        Plural name of the questions.
    """
    if tally.first_bad is not None:
        index, error = tally.first_bad
        field = "" if error.field is None else f"{error.field}: "
        others = tables.counted(tally.bad - 1, f"more {noun[:-1]} is", f"more {noun} are")
        more = f"; {others} bad input" if tally.bad > 1 else ""
        if named := [where(each) for each in tally.further_bad]:
            rest = ", …" if tally.bad - 1 > len(named) else ""
            more += f": {', '.join(named)}{rest}"
        tables.note(f"{where(index)}: {field}{error.message}{more}")


def exit_status(tally: bulk.Tally) -> int:
    """Return the worst exit status that the requests of all answers would have alone.

    From worst to best: 1 failed or lost, 2 bad input, 3 overloaded or infeasible, 0 done.
    """
    status = tables.ExitStatus
    found = [status.of(each) for each in tally.statuses]
    found += [
        status.BAD_INPUT if kind in wire.REQUEST_KINDS else status.FAILED for kind in tally.kinds
    ]
    worst_first = (status.FAILED, status.BAD_INPUT, status.OVERLOADED, status.DONE)
    return min(found, key=worst_first.index, default=status.DONE)


def _counts(tally: bulk.Tally) -> dict[str, int]:
    statuses = ("optimal", "overloaded", "infeasible", "failed")
    return {status: tally.statuses[status] for status in statuses}


def _summary(tally: bulk.Tally, elapsed: float) -> dict[str, object]:
    middle, longest = tally.middle_and_longest()
    return {
        "v": 1,
        "requests": tally.count,
        **_counts(tally),
        "errors": dict(tally.kinds),
        "time": {"median": middle, "longest": longest, "elapsed": elapsed},
    }


def _print(tally: bulk.Tally, before: int, elapsed: float, file: Path | None) -> None:

    out = tables.console()
    rows: list[tuple[object, ...]] = [
        (status, count, *tally.middle_and_longest(status))
        for status, count in _counts(tally).items()
    ]
    rows += [(f"error: {kind}", count, None, None) for kind, count in sorted(tally.kinds.items())]
    columns = (
        tables.name("answer", "0"),
        tables.number("requests", "1"),
        tables.number("median ms", "2", ".1f", scale=1e3),
        tables.number("longest ms", "3", ".1f", scale=1e3),
    )
    tables.print_rows(rows, columns, out)
    if tables.verbosity() < 0:
        out.print(", ".join(f"{count} {answer}" for answer, count, *_ in rows if count) or "none")
    done = tally.count - before
    rate = done / elapsed if elapsed > 0.0 else 0.0
    known = f", {before} were answered before" if before else ""
    out.print(f"{done} requests in {elapsed:.1f} s, {rate:.0f} a second{known}")
    if file is not None:
        out.print(f"written: {file}", soft_wrap=True)


def is_listed(output: Path, listing: Listing, several: bool, resume: bool) -> bool:
    """Return whether the output is a file of many results, not the folder of one.

    Parameters
    ----------
    output : Path
    listing : Listing
    several, resume : bool
        Whether there are several; whether their run goes on where it was broken off.
    """
    if output.suffix.lower() in {".jsonl", ".csv", ".parquet"}:
        return True
    if several:
        raise InvalidInputError(
            f"{output}: many {listing.noun} need a file that ends in {LISTED_ENDINGS}", field="-o"
        )
    if resume:
        raise InvalidInputError(f"requires -o FILE that ends in {LISTED_ENDINGS}", field="--resume")
    ends_so = output.suffix.lower() in (".json", *options.PICTURE_ENDINGS)
    if not output.is_dir() and (output.exists() or ends_so):
        raise InvalidInputError(
            f"{output}: must be a folder, or end in {LISTED_ENDINGS}", field="-o"
        )
    return False
