"""Define the ``crux`` command line: its commands, their options in common, and exit statuses.

Exit status: 0 done and feasible; 3 done, but infeasible or overloaded; 2 bad input, with one line
on standard error; 1 anything else.

This module loads only what ``--help``, ``--version`` and completion need; the module of a command
is loaded when that command is called (lazy loading).
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Final, NamedTuple

import click

from hand_models.base import DISTRIBUTION_NAME
from service.tables import VERBOSITY_KEY, ExitStatus, note

__all__ = ["COMMANDS_BY_NAME", "crux", "run_command_line"]


class Entry(NamedTuple):
    """Entry of the table of commands.

    Attributes
    ----------
    module : str
        Module of the command in `service.commands`.
    words : str
        First sentence of the command's help.
    """

    module: str
    words: str


WORDS_BY_MODULE: Final = {
    "batch": {
        "batch": "Answer many plan requests: one a line in, one reply, row or error out, in order.",
    },
    "holds": {
        "holds": "Propose holds on ROCK, a mesh in metres (of a scan, `crux rock` makes one).",
    },
    "live": {
        "play": "Send the set-points of a climb to a robot: publish them in time, until the "
        "end or Ctrl-C.",
        "stream": "Give set-points for one body wrench after another, read line by line.",
        "view": "Open a page to drag the body and the hands on their rock; the plan follows.",
    },
    "network": {
        "keys": "Make certificates and rights: who may ask a service, and who may only watch it.",
        "query": "Ask a running service for a plan.",
        "serve": "Answer questions on zenoh until SIGTERM or Ctrl-C.",
        "top": "Show what a running service does, until Ctrl-C: clients, queue, workers, "
        "streams, times.",
    },
    "plans": {
        "demo": "Start the service, ask it for a plan of a real stance, and draw the answer.",
        "new": "Write a commented start of a stance, a route, a robot or a hand, as TOML that "
        "runs.",
        "plan": "Make one plan, without the network.",
        "redundancy": "Plan without each tile, finger and hand, one at a time, without moving.",
        "schema": "Print the JSON Schema of every message.",
    },
    "rock": {
        "rock": "Make a mesh hold of a scan: points, a grid of heights, or triangles.",
    },
    "routes": {
        "climb": "Search for the best climb on each ROCK, with proof how much better any "
        "other can be.",
        "route": "Plan climbs: every stage, and every move between two stages.",
    },
    "spaces": {
        "body-space": "Show what the body can bear: which wrenches, and which accelerations.",
        "screen": "Rank stances by their load factors; solve only those that may be the best.",
        "wrench-space": "Show what one hand can carry.",
    },
    "studies": {
        "check": "Recompute what the certificate of a climb claims, without the search.",
        "replay": "Ask all questions of a recording again, here, and say what has moved in "
        "the answers.",
        "study": "Run an experiment of the paper again, and compare its claims with the model.",
    },
    "sweep": {
        "simulate": "Let tiles slip at random: count how often all hands hold, with new "
        "set-points or without.",
        "sweep": "Plan a stance over varied fields: a table, a picture, and where it stops "
        "holding.",
    },
}
"""First sentence of the help of each command, by the module of the command and its name."""

COMMANDS_BY_NAME: Final = {
    name: Entry(module, words)
    for module, commands in WORDS_BY_MODULE.items()
    for name, words in commands.items()
}


def _verbosity(context: click.Context, option: click.Parameter, given: bool) -> None:
    if given:
        context.meta[VERBOSITY_KEY] = 1 if option.name == "verbose" else -1


def _say_more_or_less(command: click.Command) -> click.Command:
    """Add the options that every command has, before or after its name; to those of a group."""
    if isinstance(command, click.Group):
        for own in command.commands.values():
            _say_more_or_less(own)
    command.params += [
        click.Option(
            ["-v", "--verbose"],
            is_flag=True,
            expose_value=False,
            callback=_verbosity,
            help="Say more: how a plan was found, the time taken; serve: a line a question.",
        ),
        click.Option(
            ["-q", "--quiet"],
            is_flag=True,
            expose_value=False,
            callback=_verbosity,
            help="Say less: outcome, errors, numbers in doubt; no tables, progress or remarks.",
        ),
    ]
    return command


class Commands(click.Group):
    """Click group that loads the module of a command when the command is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(COMMANDS_BY_NAME)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS_BY_NAME:
            return None
        module = import_module(f"service.commands.{COMMANDS_BY_NAME[cmd_name].module}")
        command: click.Command = getattr(module, f"{cmd_name.replace('-', '_')}_command")
        if not any(option.name == "verbose" for option in command.params):
            _say_more_or_less(command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; with ``--verbose``, print its duration to standard error."""
        start, used = time.perf_counter(), time.process_time()
        try:
            return super().invoke(ctx)
        finally:
            # a service writes to its log only; nobody may read standard error
            if ctx.meta.get(VERBOSITY_KEY, 0) > 0 and ctx.invoked_subcommand != "serve":
                took, used = time.perf_counter() - start, time.process_time() - used
                note(f"took {took:.2f} s, {used:.2f} s of this process's time")

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each command with its summary into the help, without loading the command."""
        limit = formatter.width - 6 - max(map(len, COMMANDS_BY_NAME))
        short = {
            name: click.Command(name, help=COMMANDS_BY_NAME[name].words).get_short_help_str(limit)
            for name in self.list_commands(ctx)
        }
        with formatter.section("Commands"):
            formatter.write_dl([*short.items()])

    def shell_complete(
        self, ctx: click.Context, incomplete: str
    ) -> list[click.shell_completion.CompletionItem]:
        """Return completions for a beginning: names of commands with their help, and options."""
        from click.shell_completion import CompletionItem

        names = [name for name in self.list_commands(ctx) if name.startswith(incomplete)]
        commands = [CompletionItem(name, help=COMMANDS_BY_NAME[name].words) for name in names]
        return commands + click.Command.shell_complete(self, ctx, incomplete)


def run_command_line(arguments: Sequence[str] | None = None) -> int:
    """Run a command line, print errors as one line on standard error, and return the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments after ``crux``; by default those of this process.

    Returns
    -------
    int
        0, 1, 2 or 3, as the module describes. An unexpected error, no `CruxError`, is raised.
    """
    try:
        status = crux.main(args=arguments, prog_name="crux", standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else 0
    except click.ClickException as error:
        return _complain(error.format_message().rstrip(".") + _hint(error), ExitStatus.BAD_INPUT)
    except click.Abort:
        return _complain("interrupted", ExitStatus.FAILED)
    except BrokenPipeError:
        # nobody reads any more
        _drop_output()
        return ExitStatus.FAILED
    except OSError as error:
        if error.filename is not None:
            return _complain(f"{error.filename}: {error.strerror}", ExitStatus.FAILED)
        _drop_output()
        return _complain(
            f"cannot write standard output: {error.strerror or error}", ExitStatus.FAILED
        )
    except Exception as error:
        return _complain(str(error), _status_of(error))


def _status_of(error: Exception) -> int:
    """Return the exit status of a `CruxError`; raise any other error again."""
    from hand_models.base import CruxError, InvalidInputError
    from service.wire import REQUEST_KINDS

    if not isinstance(error, CruxError):
        raise error
    bad = isinstance(error, InvalidInputError) or error.kind in REQUEST_KINDS
    return ExitStatus.BAD_INPUT if bad else ExitStatus.FAILED


def _drop_output() -> None:
    """Keep Python from writing at its exit what cannot be written."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str, status: int) -> int:
    note(message)
    return status


def _hint(error: click.ClickException) -> str:
    """Return which command's help to read after a usage error; empty after any other error."""
    if not isinstance(error, click.UsageError):
        return ""
    name = "crux" if error.ctx is None else error.ctx.command_path
    return f"; see {name} --help"


@click.group(
    cls=Commands, context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False
)
@click.version_option(package_name=DISTRIBUTION_NAME, message="%(prog)s %(version)s")
def crux() -> None:
    """Plan which hand of a climbing robot carries how much.

    STANCE is the path of a JSON or TOML file with a plan request, - for standard input, or the name
    of a bundled stance: boulders, ledge, overhang, slab, wall, wall-300, wall-300-floating,
    wall-300-joints, wall-700.
    ROUTE is the same for a climb; knobs, knobs-blocked and six-moves are bundled. LIMB is
    front_right, rear_right, rear_left or front_left. --hand FILE puts numbers of your own in place
    of the bundled hand's, --robot FILE a robot of your own in place of RoboSimian.

    Exit status: 0 done and feasible, 3 done but overloaded or infeasible, 2 bad input (one line on
    standard error names the field), 1 anything else.
    """


_say_more_or_less(crux)
