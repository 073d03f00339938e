"""The ``crux`` command.

Exit status: 0 done and feasible; 3 done, but infeasible or overloaded; 2 bad input, with one line
on standard error; 1 anything else.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
import msgspec

from hand_models import studies
from hand_models.base import CruxError, InvalidInputError
from hand_models.parameters import ParameterTable, own_hand
from service.commands.batch import batch
from service.commands.holds import holds
from service.commands.network import demo, query, serve
from service.commands.options import (
    asked,
    draws_option,
    explain_option,
    folder_option,
    hand_option,
    json_option,
    robot_option,
    with_extras,
)
from service.commands.rock import rock
from service.commands.spaces import body_space, wrench_space
from service.commands.stances import read_request, read_route
from service.commands.stream import stream
from service.commands.studies import (
    NAMES as STUDY_NAMES,
    chosen_study,
    print_study,
    sweep_options,
)
from service.commands.sweep import sweep
from service.commands.terminal import (
    BAD_INPUT,
    DONE,
    EXIT_STATUS,
    FAILED,
    OVERLOADED,
    draw_plan,
    filling_folder,
    note,
    progress,
    say,
    waiting,
)
from service.replies import BriefPlanReply, PlanReply
from service.requests import Draw, PlanRequest, Want
from service.tables import console, print_plan
from service.wire import REQUEST_KINDS, schema as message_schema

if TYPE_CHECKING:
    from planner.robots import RobotFile
    from service.answering import Robots

__all__ = ["crux", "run"]

NAME: Final = "crux"


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line, and return its exit status."""
    try:
        status = crux.main(args=arguments, prog_name=NAME, standalone_mode=False)
        sys.stdout.flush()
        return status if isinstance(status, int) else DONE
    except click.ClickException as error:
        return _complain(error.format_message().rstrip(".") + _hint(error), BAD_INPUT)
    except CruxError as error:
        bad = isinstance(error, InvalidInputError) or error.kind in REQUEST_KINDS
        return _complain(str(error), BAD_INPUT if bad else FAILED)
    except click.Abort:
        return _complain("interrupted", FAILED)
    except BrokenPipeError:
        # nobody reads any more
        _drop_output()
        return FAILED
    except OSError as error:
        if error.filename is not None:
            return _complain(str(error), FAILED)
        _drop_output()
        return _complain(f"cannot write standard output: {error.strerror or error}", FAILED)


def _drop_output() -> None:
    """Keep Python from writing at its exit what cannot be written."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str, status: int) -> int:
    note(message)
    return status


def _hint(error: click.ClickException) -> str:
    """Say whose help tells how a command is used, if that went wrong."""
    if not isinstance(error, click.UsageError):
        return ""
    name = NAME if error.ctx is None else error.ctx.command_path
    return f"; see {name} --help"


@click.group(context_settings={"help_option_names": ["-h", "--help"]}, no_args_is_help=False)
def crux() -> None:
    """Plan which hand of a climbing robot carries how much.

    STANCE is the path of a JSON file with a plan request, - for standard input, or the name of a
    bundled stance: boulders, ledge, overhang, slab, wall, wall-300, wall-300-floating,
    wall-300-joints, wall-700.
    ROUTE is the same of a climb; bundled is six-moves. LIMB is front_right, rear_right, rear_left
    or front_left. --hand FILE puts numbers of your own in place of the bundled hand's, --robot FILE
    a robot of your own in place of RoboSimian.

    Exit status: 0 done and feasible, 3 done but overloaded or infeasible, 2 bad input (one line on
    standard error names the field), 1 anything else.
    """


@crux.command()
@click.argument("stance")
@click.option(
    "--plot", "picture", type=click.Path(path_type=Path), metavar="FILE", help="Draw it there."
)
@click.option(
    "--robust",
    is_flag=True,
    help="And the least load factor where every hand is a little elsewhere.",
)
@click.option(
    "--spread",
    is_flag=True,
    help="And how far utilisation and load factor spread over what is not known of hand and rock.",
)
@click.option(
    "--clearance", is_flag=True, help="And the least distances of body, hands, links and rock."
)
@click.option(
    "--advice",
    "advice_folder",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Write what would make it hold there, each advice as a STANCE of its own.",
)
@draws_option
@explain_option
@hand_option
@robot_option
@json_option
def plan(
    stance: str,
    picture: Path | None,
    robust: bool,
    spread: bool,
    clearance: bool,
    advice_folder: Path | None,
    draws: list[Draw] | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Make one plan, without the network."""
    from planner import deadline
    from service import answering
    from service.answering import robots_of

    extras: list[Want] = ["robust"] if robust else []
    extras += ["spread"] if spread or draws else []
    extras += ["clearance"] if clearance else []
    extras += ["advice"] if advice_folder is not None else []
    request = asked(read_request(stance), hand, robot)
    if draws:
        request = msgspec.structs.replace(request, draws=draws)
    if unexplained:
        request = msgspec.structs.replace(request, explain=False)
    request = with_extras(request, *extras, whole=not as_json)
    if advice_folder is not None and request.detail != "full":
        raise InvalidInputError("--advice needs the full reply; leave it out", field="detail")
    robots = robots_of(robot)
    with waiting(f"planning {stance}", request):
        with deadline.within(request.deadline):
            answer = answering.planned(request, robots)
            if not as_json and answer.reply.status in ("overloaded", "infeasible"):
                answer = answering.with_advice(answer)
            bare = _without_palms(request, robots) if request.detail == "full" else None
        if picture is not None:
            draw_plan(answer, picture)
    written: list[Path] = []
    if advice_folder is not None:
        assert isinstance(answer.reply, PlanReply)  # of a whole request
        written = _write_advice(request, answer.reply, advice_folder)
    if isinstance(answer.reply, BriefPlanReply):
        say(answer.reply)
    elif as_json:
        without = {"load_factor_without_palm": None if bare is None else bare.load_factor}
        say(msgspec.to_builtins(answer.reply) | without)
    else:
        print_plan(answer.reply, console(), without_palm=bare)
        if written:
            last = f" to {written[-1].name}, the best first" if len(written) > 1 else ""
            click.echo(f"advice: {written[0]}{last}")
    return EXIT_STATUS.get(answer.reply.status, FAILED)


def _write_advice(request: PlanRequest, reply: PlanReply, folder: Path) -> list[Path]:
    """Write each advice as a request whose plan gives what it promises, and none of another.

    Returns their paths.
    """
    from service import answering

    written = []
    with filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("advice-*.json"):
            if old.stem.removeprefix("advice-").isdecimal():
                old.unlink()
        for i, advice in enumerate(reply.advice or ()):
            text = msgspec.json.format(msgspec.json.encode(answering.advised(request, advice)))
            written.append(folder / f"advice-{i + 1}.json")
            written[-1].write_bytes(text)
    return written


def _without_palms(request: PlanRequest, robots: Robots) -> PlanReply | None:
    """Return how much could be carried if no palm did; None if the time is over before."""
    from planner.deadline import DeadlineError
    from service import answering

    replace = msgspec.structs.replace
    hands = [replace(hand, grasp=replace(hand.grasp, palm=False)) for hand in request.stance.hands]
    stance = replace(request.stance, hands=hands)
    alone = replace(request, stance=stance, want=["load_factor"], draws=[], explain=False)
    try:
        reply = answering.plan(alone, robots)
    except DeadlineError:
        return None
    assert isinstance(reply, PlanReply)  # of a whole request
    return reply


@crux.command()
@click.argument("route")
@folder_option("Where the table, the picture and the summary go.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes; by default as many as are worth it."
)
@explain_option
@hand_option
@robot_option
@json_option
def route(
    route: str,
    folder: Path,
    workers: int | None,
    unexplained: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Evaluate a climb: every stance, and every one with a limb in the air.

    ROUTE is the path of a JSON file, - for standard input, or the name of a bundled route.
    """
    from planner.pictures import summary, write_report
    from planner.route import evaluate
    from service import answering
    from service.answering import robots_of
    from service.tables import print_route

    request = asked(read_route(route), hand, robot)
    if unexplained:
        request = msgspec.structs.replace(request, explain=False)
    climb = answering.route(request, robots_of(robot))
    with progress(f"planning {climb.name}") as tell:
        result = evaluate(climb, workers, tell)
    with filling_folder():
        files = write_report(result, folder)
    if as_json:
        say(summary(result) | {"files": {name: str(path) for name, path in files.items()}})
    else:
        print_route(result, files, console())
    if result.feasible:
        return DONE
    return FAILED if any(plan.status == "failed" for plan in result.plans) else OVERLOADED


@crux.command(epilog=f"NAME is one of {', '.join(STUDY_NAMES)}.")
@click.argument("name")
@folder_option("Where result.json and the pictures go.")
@sweep_options
@hand_option
@json_option
def study(
    name: str, folder: Path, hand: ParameterTable | None, as_json: bool, **options: Any
) -> None:
    """Run an experiment of the paper again, and hold its claims against the model.

    The study sweep has no claims: it draws what the test gripper holds over any two of its numbers.
    The exit status is 0 whatever the claims say.
    """
    chosen = chosen_study(name, **options)
    numbers = None if hand is None else own_hand(hand)
    line = None if as_json else f"study {name}: started; it may take minutes"
    with filling_folder(), progress(name, line=line) as tell:
        result, files = studies.run_study(chosen, folder, tell, numbers)
    if as_json:
        say(studies.as_json(result) | {"files": [str(path) for path in files]})
    else:
        print_study(result, files, console())


@crux.command()
@json_option
def schema(as_json: bool) -> None:
    """Print the JSON Schema of every message."""
    text = msgspec.json.encode(message_schema())
    click.echo(text if as_json else msgspec.json.format(text))


for command in (batch, sweep, stream, rock, holds, wrench_space, body_space, serve, query, demo):
    crux.add_command(command)


if __name__ == "__main__":
    from service.commands import main

    main()
