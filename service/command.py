"""The ``crux`` command.

Exit status: 0 done and feasible; 3 done, but infeasible or overloaded; 2 bad input, with one line
on standard error; 1 anything else.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, get_args

import click
import msgspec
import zenoh

from hand_models import studies
from hand_models.errors import CruxError, InvalidInputError
from hand_models.parameters import ParameterTable
from hand_models.parameters.own import own_hand
from service.client import TIMEOUT, CruxClient
from service.config import (
    listening,
    open_session,
    start_zenoh_log,
    zenoh_config,
    zenoh_options,
)
from service.errors import REQUEST_KINDS
from service.keys import DEFAULT_ROBOT
from service.own_hand import read_hand, with_hand
from service.replies import PlanReply
from service.requests import (
    Axis,
    BodySpaceRequest,
    PlanRequest,
    RouteRequest,
    Want,
    WrenchSpaceRequest,
)
from service.schema import schema as message_schema
from service.stances import read_request, read_route
from service.studies import chosen_study, print_study, sweep_options
from service.tables import console, print_plan, print_wrench_space

if TYPE_CHECKING:
    from planner.robot_file import RobotFile
    from service.dispatch import Planned

__all__ = ["crux", "main", "run"]

R = TypeVar("R", PlanRequest, RouteRequest)

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
OVERLOADED: Final = 3

EXIT_STATUS: Final = {"optimal": DONE, "overloaded": OVERLOADED, "infeasible": OVERLOADED}
"""By a plan's status; any other is `FAILED`."""

PICTURES: Final = (".png", ".pdf", ".svg")
HAND_FILE: Final = ".toml"
DEMO_STANCE: Final = "wall-300-joints"
EXTRAS: Final[tuple[Want, ...]] = ("load_factor", "prices")
"""What the command line asks for besides the plan."""


def main() -> None:
    """Run the command line of this process, and exit."""
    sys.exit(run())


def run(arguments: Sequence[str] | None = None) -> int:
    """Run a command line, and return its exit status."""
    try:
        status = crux.main(args=arguments, prog_name="crux", standalone_mode=False)
        return status if isinstance(status, int) else DONE
    except click.ClickException as error:
        hint = "; see crux --help" if isinstance(error, click.UsageError) else ""
        return _complain(error.format_message().rstrip(".") + hint, BAD_INPUT)
    except CruxError as error:
        bad = isinstance(error, InvalidInputError) or error.kind in REQUEST_KINDS
        return _complain(str(error), BAD_INPUT if bad else FAILED)
    except click.Abort:
        return _complain("interrupted", FAILED)
    except BrokenPipeError:
        # nobody reads any more; keep Python from saying so at its exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except OSError as error:
        return _complain(str(error), FAILED)


def _complain(message: str, status: int) -> int:
    click.echo(f"crux: {' '.join(message.split())}", err=True)
    return status


def _say(result: object) -> None:
    """Write a result as one line of JSON."""
    click.echo(msgspec.json.encode(result))


def _check_picture(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
    if path is not None and path.suffix not in PICTURES:
        raise click.BadParameter(f"{path}: valid endings are {', '.join(PICTURES)}")
    if path is not None and not path.parent.is_dir():
        raise click.BadParameter(f"{path}: no such folder")
    return path


def _read_hand(
    _: click.Context, __: click.Parameter, paths: tuple[Path, ...]
) -> ParameterTable | None:
    if not paths:
        return None
    if len(paths) > 1:
        raise click.BadParameter(f"one FILE at most, got {', '.join(map(str, paths))}")
    if paths[0].suffix != HAND_FILE and not paths[0].exists():
        raise click.BadParameter(
            f"{paths[0]}: no such file; a FILE with numbers of a hand is wanted, not a LIMB"
        )
    return read_hand(paths[0])


def _read_robot(_: click.Context, __: click.Parameter, path: Path | None) -> RobotFile | None:
    if path is None:
        return None
    from service.own_robot import read_robot

    return read_robot(path)


def _asked(request: R, hand: ParameterTable | None, robot: RobotFile | None) -> R:
    """Return a request for a hand and a robot of the caller's own."""
    request = with_hand(request, hand)
    if robot is None:
        return request
    from service.own_robot import with_robot

    return with_robot(request, robot)


json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
hand_option = click.option(
    "--hand",
    type=click.Path(path_type=Path),
    multiple=True,
    callback=_read_hand,
    metavar="FILE",
    help="TOML with numbers of a hand of your own; all others are the bundled hand's.",
)
robot_option = click.option(
    "--robot",
    type=click.Path(path_type=Path),
    callback=_read_robot,
    metavar="FILE",
    help="TOML that describes a robot of your own, and names its URDF.",
)


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
@hand_option
@robot_option
@json_option
def plan(
    stance: str,
    picture: Path | None,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Make one plan, without the network."""
    from service import dispatch
    from service.own_robot import robots_of

    request = _with_extras(_asked(read_request(stance), hand, robot))
    robots = robots_of(robot)
    with _waiting(f"planning {stance}", request):
        answer = dispatch.planned(request, robots)
        if picture is not None:
            _draw_plan(answer, picture)
        bare = dispatch.plan(_without_palms(request), robots)
    if as_json:
        without = {"load_factor_without_palm": bare.load_factor}
        _say(msgspec.to_builtins(answer.reply) | without)
    else:
        print_plan(answer.reply, console(), without_palm=bare)
    return EXIT_STATUS.get(answer.reply.status, FAILED)


def _draw_plan(answer: Planned, picture: Path) -> None:
    from planner import plan_plots

    with _writing(picture):
        plan_plots.plot_plan(answer.plan, answer.question, picture)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn what goes wrong in writing a picture into one line about the option."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"cannot write {path}: {error}", field="--plot") from None


def _with_extras(request: PlanRequest) -> PlanRequest:
    return msgspec.structs.replace(request, want=list(dict.fromkeys([*request.want, *EXTRAS])))


def _without_palms(request: PlanRequest) -> PlanRequest:
    """Return the question how much could be carried if no palm did."""
    replace = msgspec.structs.replace
    hands = [replace(hand, grasp=replace(hand.grasp, palm=False)) for hand in request.stance.hands]
    return replace(request, stance=replace(request.stance, hands=hands), want=["load_factor"])


def _limb_and_hand(
    _: click.Context, __: click.Parameter, given: tuple[str, ...]
) -> tuple[str, ParameterTable | None]:
    """Tell the limb, which the contract calls a hand, from the file of one."""
    files = [value for value in given if value.endswith(HAND_FILE)]
    limbs = [value for value in given if not value.endswith(HAND_FILE)]
    if len(limbs) != 1 or len(files) > 1:
        raise click.BadParameter(
            f"one LIMB and at most one FILE that ends in {HAND_FILE}, got {', '.join(given)}"
        )
    return limbs[0], read_hand(Path(files[0])) if files else None


@crux.command("wrench-space")
@click.argument("stance")
@click.option(
    "--hand",
    "limb_and_hand",
    required=True,
    multiple=True,
    callback=_limb_and_hand,
    metavar="LIMB",
    help="Whose wrench space. A second --hand FILE, ending in .toml, has numbers of a hand of your "
    "own; all others are the bundled hand's.",
)
@click.option(
    "--plot",
    "picture",
    type=click.Path(path_type=Path),
    callback=_check_picture,
    metavar="FILE",
    help="Draw it there.",
)
@click.option(
    "--search",
    "per_axis",
    type=click.IntRange(3, 25),
    metavar="N",
    help="Of a floating hand: search N^6 poses of its wrist, too.",
)
@robot_option
@json_option
def wrench_space(
    stance: str,
    limb_and_hand: tuple[str, ParameterTable | None],
    picture: Path | None,
    per_axis: int | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Show what one hand can carry."""
    from planner import settling
    from planner.wrist_survey import survey
    from service import dispatch, questions
    from service.own_robot import robots_of
    from service.surveys import print_survey, survey_json

    limb, hand = limb_and_hand
    robots = robots_of(robot)
    request = WrenchSpaceRequest(
        v=1, stance=_asked(read_request(stance), hand, robot).stance, limb=limb
    )
    reply = dispatch.wrench_space(request, robots)
    found = None
    if per_axis is not None:
        wrist = settling.floating_wrist(questions.stance(request.stance, robots), limb)
        with _progress(f"{per_axis}^6 poses of {limb}") as tell:
            found = survey(wrist, per_axis, tell)
    if picture is not None:
        from planner import hand_plots

        drawn = questions.stance(request.stance, robots)
        settled, space = settling.hand_space(drawn, limb)
        shown, preload = space if reply.vertices else None, None
        if reply.wrist.mode == "floating":
            preload = settling.floating_wrist(drawn, limb).hand.preload
        with _writing(picture):
            hand_plots.plot_wrench_space(settled, shown, picture, f"{limb} of {stance}", preload)
    if as_json:
        searched = {} if found is None else {"search": survey_json(found)}
        _say(msgspec.to_builtins(reply) | searched)
    else:
        print_wrench_space(reply, console())
        if found is not None:
            print_survey(found, console())
    return DONE if reply.vertices else OVERLOADED


def _check_axes(_: click.Context, __: click.Parameter, given: str) -> list[Axis]:
    names = [name.strip() for name in given.split(",")]
    axes = [axis for name in names for axis in get_args(Axis) if axis == name]
    if len(names) != 2 or len(axes) != 2 or axes[0] == axes[1]:
        raise click.BadParameter(
            f"two different ones of {', '.join(get_args(Axis))} are wanted, as fx,fz; got {given}"
        )
    return axes


@crux.command("body-space")
@click.argument("stance")
@click.option(
    "--axes",
    default="fx,fz",
    show_default=True,
    callback=_check_axes,
    metavar="AXIS,AXIS",
    help="Of the plane of body wrenches that is shown: fx, fy, fz, mx, my or mz, in B.",
)
@click.option(
    "--projection",
    "others",
    flag_value="free",
    help="Whatever the other components; as asked for by default.",
)
@click.option("--pure", "others", flag_value="zero", help="With the other components zero.")
@click.option(
    "--plot",
    "picture",
    type=click.Path(path_type=Path),
    callback=_check_picture,
    metavar="FILE",
    help="Draw it there, and the largest accelerations in two planes.",
)
@hand_option
@robot_option
@json_option
def body_space(
    stance: str,
    axes: list[Axis],
    others: Literal["free", "zero"] | None,
    picture: Path | None,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Show what the body can bear: which wrenches, and which accelerations."""
    from service.body_space import explore, print_body_space
    from service.own_robot import robots_of

    asked = _asked(read_request(stance), hand, robot)
    request = BodySpaceRequest(
        v=1,
        id=asked.id,
        stance=asked.stance,
        body_wrench=asked.body_wrench,
        load=asked.load,
        limits=asked.limits,
        present=asked.present,
        axes=axes,
        others=others or "needed",
    )
    with _waiting(f"exploring {stance}", asked):
        found = explore(request, robots_of(robot))
        if picture is not None:
            from planner import body_plots

            with _writing(picture):
                body_plots.plot_body_space(found.space, found.section, picture, stance)
    if as_json:
        _say(found.reply)
    else:
        print_body_space(found.reply, console())
    return EXIT_STATUS.get(found.reply.status, FAILED)


@crux.command()
@zenoh_options
@hand_option
@robot_option
@json_option
def serve(
    config: zenoh.Config, hand: ParameterTable | None, robot: RobotFile | None, as_json: bool
) -> None:
    """Answer questions on zenoh until SIGTERM or Ctrl-C.

    The hand of --hand is that of every question; a question's own numbers go on top. The robot of
    --robot is the only one that is planned for, and gives the keys its name.
    """
    stop = _StopSignal()
    from service.server import PlanService, prepare_zenoh

    logging.basicConfig(format="crux: %(levelname)s: %(message)s")
    prepare_zenoh()
    start_zenoh_log()
    endpoints = listening(config)
    with open_session(config) as session, PlanService(session, robot, hand) as service:
        if as_json:
            _say({"v": 1, "keys": service.keys, "listen": endpoints})
        where = ", ".join(endpoints) or "no address"
        click.echo(f"crux: serving {', '.join(service.keys)}; listening on {where}", err=True)
        stop.wait()


class _StopSignal:
    """SIGTERM or Ctrl-C, from now on.

    A signal may well arrive in a thread of zenoh's or of a solver's, and does not wake the main
    thread then; what does is the byte that its handler writes to a pipe.
    """

    NUMBERS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        self._arrived, wakeup = os.pipe()
        os.set_blocking(wakeup, False)
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
        for number in self.NUMBERS:
            signal.signal(number, lambda *_: None)

    def wait(self) -> None:
        """Wait for the first; a second one kills."""
        os.read(self._arrived, 1)
        for number in self.NUMBERS:
            signal.signal(number, signal.SIG_DFL)


def _timeout_option(command: Callable[..., Any]) -> Callable[..., Any]:
    return click.option(
        "--timeout", type=click.FloatRange(min=0.01), default=TIMEOUT, show_default=True, help="[s]"
    )(command)


@crux.command()
@click.argument("stance")
@zenoh_options
@_timeout_option
@hand_option
@robot_option
@json_option
def query(
    stance: str,
    config: zenoh.Config,
    timeout: float,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Ask a running service for a plan.

    It has to serve the robot that the stance or --robot names.
    """
    request = _with_extras(_asked(read_request(stance), hand, robot))
    start_zenoh_log()
    with CruxClient(config, request.stance.robot or DEFAULT_ROBOT, timeout=timeout) as client:
        reply = client.plan(request)
    return _show(reply, as_json)


def _show(reply: PlanReply, as_json: bool) -> int:
    if as_json:
        _say(reply)
    else:
        print_plan(reply, console())
    return EXIT_STATUS.get(reply.status, FAILED)


@crux.command()
@click.option(
    "-o",
    "--output",
    "picture",
    type=click.Path(path_type=Path),
    callback=_check_picture,
    default=Path("crux-demo.png"),
    show_default=True,
    metavar="FILE",
    help="Where the picture goes.",
)
@hand_option
@robot_option
@json_option
def demo(picture: Path, hand: ParameterTable | None, robot: RobotFile | None, as_json: bool) -> int:
    """Start the service, ask it for a plan of a real stance, and draw the answer."""
    from service import dispatch
    from service.own_robot import robots_of
    from service.server import PlanService

    request = _with_extras(_asked(read_request(DEMO_STANCE), hand, robot))
    start_zenoh_log()
    config = zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with open_session(config) as session, PlanService(session, robot) as service:
        reply = CruxClient(session, service.robot).plan(request)
    _draw_plan(dispatch.planned(request, robots_of(robot)), picture)
    status = _show(reply, as_json)
    if not as_json:
        console().print(f"picture: {picture}", markup=False)
    return status


def _folder_option(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    return click.option(
        "-o",
        "--output",
        "folder",
        type=click.Path(path_type=Path, file_okay=False),
        required=True,
        metavar="DIR",
        help=text,
    )


@contextmanager
def _progress(title: str, *, line: str | None = None) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on standard error while the work lasts; yields what tells it done and total.

    Where no bar can be shown, the line, if there is one, is written when the first step is told.
    """
    from rich.progress import Progress

    screen = console(stderr=True)
    lines = [line] if line is not None and not screen.is_terminal else []
    with Progress(console=screen, transient=True, disable=not screen.is_terminal) as bar:
        task = bar.add_task(title, total=None)

        def tell(done: int, total: int) -> None:
            if lines:
                click.echo(lines.pop(), err=True)
            bar.update(task, completed=done, total=total)

        yield tell


@contextmanager
def _waiting(title: str, request: PlanRequest) -> Iterator[None]:
    """Show on a terminal's standard error that hands with floating wrists take a while."""
    screen = console(stderr=True)
    slow = any(hand.wrist == "floating" for hand in request.stance.hands)
    if slow and screen.is_terminal:
        with screen.status(title):
            yield
    else:
        yield


@contextmanager
def _filling_folder() -> Iterator[None]:
    """Turn what goes wrong in writing a folder into one line about it."""
    try:
        yield
    except OSError as error:
        raise InvalidInputError(f"{error.strerror}: {error.filename}", field="DIR") from None


@crux.command()
@click.argument("route")
@_folder_option("Where the table, the picture and the summary go.")
@click.option(
    "--workers", type=click.IntRange(min=1), help="Processes; by default as many as are worth it."
)
@hand_option
@robot_option
@json_option
def route(
    route: str,
    folder: Path,
    workers: int | None,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Evaluate a climb: every stance, and every one with a limb in the air.

    ROUTE is the path of a JSON file, - for standard input, or the name of a bundled route.
    """
    from planner.report import summary, write_report
    from planner.route import evaluate
    from service import questions
    from service.climb import print_route
    from service.own_robot import robots_of

    climb = questions.route(_asked(read_route(route), hand, robot), robots_of(robot))
    with _progress(f"planning {climb.name}") as tell:
        result = evaluate(climb, workers, tell)
    with _filling_folder():
        files = write_report(result, folder)
    if as_json:
        _say(summary(result) | {"files": {name: str(path) for name, path in files.items()}})
    else:
        print_route(result, files, console())
    if result.feasible:
        return DONE
    return FAILED if any(plan.status == "failed" for plan in result.plans) else OVERLOADED


@crux.command(epilog=f"NAME is one of {', '.join(studies.STUDIES)}.")
@click.argument("name")
@_folder_option("Where result.json and the pictures go.")
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
    asked = chosen_study(name, **options)
    numbers = None if hand is None else own_hand(hand)
    line = None if as_json else f"crux: study {name}: started; it may take minutes"
    with _filling_folder(), _progress(name, line=line) as tell:
        result, files = studies.run_study(asked, folder, tell, numbers)
    if as_json:
        _say(studies.as_json(result) | {"files": [str(path) for path in files]})
    else:
        print_study(result, files, console())


@crux.command()
@json_option
def schema(as_json: bool) -> None:
    """Print the JSON Schema of every message."""
    text = msgspec.json.encode(message_schema())
    click.echo(text if as_json else msgspec.json.format(text))


if __name__ == "__main__":
    main()
