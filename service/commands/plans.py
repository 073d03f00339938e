"""Define ``crux plan``, ``redundancy``, ``new``, ``demo`` and ``schema``, which need no service."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from time import perf_counter
from typing import TypeVar

import click
import msgspec

import planner
from hand_models.base import InvalidInputError, whole_file
from service import answering, replies, requests, serving, tables, wire
from service.commands import options, stances
from service.commands.declaring import argument, command, flag, group, option

__all__ = [
    "demo_command",
    "new_command",
    "plan_command",
    "redundancy_command",
    "schema_command",
]

ResultT = TypeVar("ResultT")


@command("plan")
def plan_command(
    stance: str = options.stance_argument,
    picture: Path | None = options.plot_option("Draw it there."),
    page: Path | None = options.page_option,
    robust: bool = flag("And the least load factor where every hand is a little elsewhere."),
    open_loop: bool = flag(
        "And the utilisation where hands are displaced and the plan is executed as it is."
    ),
    spread: bool = options.spread_option,
    clearance: bool = flag("And the least distances of body, hands, links and rock."),
    advice_folder: Path | None = option(
        "Write what would make it hold there, each advice as a STANCE of its own.",
        options.FOLDER_PATH,
        usage="--advice DIR",
    ),
    wanted: options.Wanted = group(
        options.Wanted, draws=options.draws_option, unexplained=options.explain_option
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Make one plan, without the network."""
    further: dict[planner.Want, bool] = {
        "robust": robust,
        "open_loop": open_loop,
        "clearance": clearance,
        "advice": advice_folder is not None,
    }
    request, given = stances.read_with_text(stance)
    plain = own.asked(request)
    extras = [want for want, chosen in further.items() if chosen]
    request = options.with_extras(
        wanted._replace(spread=spread).of(plain), *extras, whole=not as_json
    )
    if advice_folder is not None and request.detail not in (None, "full"):
        raise InvalidInputError(
            f"--advice requires the full reply, got {request.detail!r}; remove detail",
            field="detail",
        )
    if advice_folder is not None:
        tables.fill_alone(advice_folder, "--advice")
    robots = own.robots
    brief = not as_json and tables.verbosity() < 0
    advised = "advice" in request.want
    if not as_json:
        # a person reads the advice later than the plan
        request = msgspec.structs.replace(request, want=[w for w in request.want if w != "advice"])
    begun = perf_counter()
    with tables.waiting(f"planning {stance}", request):
        if request.deadline is not None or _needs_closing(request):
            from hand_models.hand import load_closing

            # the first process of a machine compiles, for longer than most deadlines
            load_closing()
        with planner.deadline.within(request.deadline):
            answer = answering.planned(request, robots)
            full = request.detail in (None, "full") and not brief
            bare = _in_time(planner.plan_without_palms, answer) if full else None
            parts = _in_time(planner.load_factors_without_palm_loads, answer) if full else None
        if picture is not None:
            tables.write_plan_picture(answer, picture)
    if not as_json:
        _print(answer, bare, parts, brief)
        if advised or (not brief and not _holds(answer)):
            # [s] with --advice the search has no timeout of its own
            seconds = None if advised else answering.ADVICE_TIME
            started = None if request.deadline is None else begun
            with planner.deadline.within(request.deadline or seconds, started=started):
                answer = _with_advice(answer, brief)
    if page is not None:
        sure = []
        if isinstance(answer.reply, replies.PlanReply):
            sure = tables.sure_sentences(answer.reply, bare, parts)
        title = "a plan" if stance == "-" else Path(stance).stem
        tables.write_answer_page(answer, page, title, sure)
    written: list[Path] = []
    if advice_folder is not None:
        assert isinstance(answer.reply, replies.PlanReply)  # of a whole request
        written = _write_advice(plain, answer.reply, advice_folder, given)
    if isinstance(answer.reply, replies.BriefPlanReply):
        tables.say(answer.reply)
    elif as_json:
        without = {
            "load_factor_without_palm": None if bare is None else bare.load_factor,
            "load_factor_without_palm_shear": None if parts is None else parts.without_shear,
            "load_factor_without_palm_pressing": None if parts is None else parts.without_pressing,
        }
        tables.say(msgspec.to_builtins(answer.reply) | without)
    else:
        _print_files(written, answer.reply)
    return tables.ExitStatus.of(answer.reply.status)


@command("demo")
def demo_command(
    picture: Path | None = option(
        "Where the picture goes; crux-demo.png by default.",
        options.OutputFile(*options.PICTURE_ENDINGS),
        usage="-o --output FILE",
    ),
    folder: Path | None = option(
        "Search for a climb on the bundled knob-wall instead; where its files go.",
        options.FOLDER_PATH,
        usage="--climb [DIR]",
        is_flag=False,
        flag_value="crux-climb",
    ),
    page: Path | None = options.page_option,
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Start the service, ask it for a plan of a real stance, and draw the answer.

    A robot of --robot whose limbs do not reach that stance's holds is planned for without joints.
    """
    if folder is not None:
        if picture is not None:
            said = f"is for the picture of a plan, got {picture}: give --climb DIR, without -o"
            raise InvalidInputError(said, field="-o")
        from service import climbs
        from service.commands.routes import search_climb

        asked = own.asked(climbs.demo_request())
        return search_climb(asked, folder, options.WorkersOption(None, None), own, as_json, page)
    picture = picture or Path("crux-demo.png")
    tables.write_alone(picture)
    request = options.with_extras(own.asked(stances.read_request("wall-300-joints")))
    serving.start_zenoh_log()
    config = serving.zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with (
        serving.open_session(config) as session,
        serving.PlanService(session, own.robot, workers=1) as service,
    ):
        # [s] its own service answers, also on a busy machine
        client = serving.CruxClient(session, service.robot, timeout=120.0)
        try:
            reply = client.plan(request)
        except wire.ServiceError as error:
            if error.kind != "unreachable":
                raise
            tables.remark(f"planned without joints: {error.message}")
            stance = msgspec.structs.replace(request.stance, joints=None)
            request = msgspec.structs.replace(request, stance=stance)
            reply = client.plan(request)
    answer = answering.planned(request, own.robots)
    tables.write_plan_picture(answer, picture)
    if page is not None:
        tables.write_answer_page(answer, page, "wall-300-joints")
    status = tables.show(reply, as_json)
    if not as_json:
        tables.console().print(f"picture: {picture}")
    return status


@command("schema")
def schema_command(
    as_json: bool = options.json_option,
) -> None:
    """Print the JSON Schema of every message."""
    text = msgspec.json.encode(wire.schema())
    click.echo(text if as_json else msgspec.json.format(text))


@command("redundancy")
def redundancy_command(
    stance: str = options.stance_argument,
    picture: Path | None = options.plot_option("Draw it there."),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Plan without each tile, finger and hand, one at a time, without moving.

    A tile that slips drags on while it is pressed. A finger that is lost is off the rock, with a
    hand that is lost all its fingers and its palm. All wrists must be fixed.

    Exit status: 3 where the stance does not hold without some tile.
    """
    request = own.asked(stances.read_request(stance))
    alone = msgspec.structs.replace(request, want=[], draws=[], open_loop=None)
    asked = answering.question(alone, own.robots)
    with tables.waiting(f"planning losses of {stance}", alone):
        with planner.deadline.within(request.deadline):
            found = planner.find_redundancy(asked)
        if picture is not None:
            with tables.writing(picture):
                planner.plot_redundancy(found, picture, stance)
    if as_json:
        tables.say(found)
    else:
        cap = asked.limits.utilisation + planner.programs.CAP_SLACK
        whole = found.utilisation is not None and found.utilisation <= cap
        tables.print_redundancy(found, tables.console(), holds=whole)
    held, count = found.held["tile"]
    return tables.ExitStatus.DONE if held == count else tables.ExitStatus.OVERLOADED


def _print(
    answer: answering.Planned,
    without_palm: planner.Plan | None,
    palm_parts: planner.PalmLoadFactors | None,
    brief: bool,
) -> None:
    """Print a plan for a person at once, before any advice."""
    assert isinstance(answer.reply, replies.PlanReply)  # as a person is given
    tables.print_plan(
        answer.reply,
        tables.console(),
        without_palm=without_palm,
        palm_parts=palm_parts,
        brief=brief,
    )
    if isinstance(answer.reply.redundancy, planner.Redundancy):
        whole = answer.reply.status == "optimal"
        tables.print_redundancy(answer.reply.redundancy, tables.console(), holds=whole)
    tables.tell_solver(answer.reply)
    sys.stdout.flush()


def _needs_closing(request: requests.PlanRequest) -> bool:
    """Return True if hands are on rock that compiled code cuts and closes fingers on."""
    rock = requests.ProfileMessage, requests.MeshMessage, requests.RockReference
    return any(isinstance(hand.hold, rock) for hand in request.stance.hands)


def _holds(answer: answering.Planned) -> bool:
    """Return whether a stance holds, as far as is known."""
    return answer.reply.status not in {"overloaded", "infeasible"}


def _with_advice(answer: answering.Planned, brief: bool) -> answering.Planned:
    """Search for advice that makes a stance hold, or hold more, and print it."""
    wanted = "better" if _holds(answer) else "feasible"
    with tables.working(f"searching for {wanted} changes"):
        found = answering.answer_with_advice(answer)
    assert isinstance(found.reply, replies.PlanReply)  # as a person is given
    assert isinstance(answer.reply, replies.PlanReply)
    if not brief:
        out = tables.console()
        tables.print_warnings(found.reply.warnings[len(answer.reply.warnings) :], out)
        tables.print_advice(found.reply, out)
    return found


def _print_files(files: list[Path], reply: replies.PlanReply) -> None:
    """Print the advice of each file."""
    out = tables.console()
    holding = reply.status == "optimal"
    for file, advice in zip(files, reply.advice or (), strict=False):
        words = tables.words_of(advice, holding=holding)
        out.print(f"{file}: {words}", soft_wrap=True)


def _write_advice(
    request: requests.PlanRequest,
    reply: replies.PlanReply,
    folder: Path,
    given: stances.Given[requests.PlanRequest],
) -> list[Path]:
    """Write each advice as a request of its own, whose plan gives what it promises.

    All other fields stay as they were ``given``, and scans stay in their files. Return the paths
    of the requests.
    """
    if given.files is not None:
        request = given.files.named(request, given.request, folder)
    written = []
    with tables.filling_folder():
        for old in folder.glob("advice-*.json"):
            if old.stem.removeprefix("advice-").isdecimal():
                old.unlink()
        for i, advice in enumerate(reply.advice or ()):
            changed = answering.advised(request, advice)
            text = answering.rewritten(given.text, given.request, changed)
            written.append(folder / f"advice-{i + 1}.json")
            written[-1].write_bytes(msgspec.json.format(text))
    return written


def _in_time(
    found: Callable[[planner.Question], ResultT], answer: answering.Planned
) -> ResultT | None:
    """Return what a function finds about a question; None if the deadline ends before."""
    try:
        return found(answer.question)
    except planner.DeadlineError:
        return None


@command("new")
def new_command(
    kind: str = argument(click.Choice(["stance", "route", "robot", "hand"])),
    file: Path | None = option(
        "File to write, .toml, which must not exist; a robot's URDF is written beside it.",
        options.OutputFile(".toml"),
        usage="-o --output FILE",
    ),
) -> int:
    """Write a commented start of a stance, a route, a robot or a hand, as TOML that runs."""
    if kind == "robot":
        if file is None:
            raise click.UsageError("a robot requires -o FILE: its URDF is written beside FILE")
        robot, urdf = planner.RobotFile.bundled(), file.with_suffix(".urdf")
        _check_new(file)
        _write(urdf, robot.urdf)
        comment = (
            "# A robot: its URDF, where its hands are mounted, and what its joints bear. This is"
            " RoboSimian.\n# Use it with: crux plan STANCE --robot FILE\n# A bare number is in SI"
            " units and counts as assumed. In place of a limb's orientation, a quaternion\n#"
            " [x, y, z, w]: rpy = [roll, pitch, yaw], or x_axis and z_axis.\n\n"
        )
        text = re.sub(r"\A(#.*\n)+\n", comment, robot.toml)
        text = text.replace(f'name = "{robot.name}"', 'name = "mine"', 1)
        text = re.sub(r'(?m)^urdf = "[^"]*"', f'urdf = "{urdf.name}"', text)
    else:
        start = resources.files("service") / "examples" / "starts" / f"{kind}.toml"
        text = start.read_text(encoding="utf-8")
    if file is None:
        click.echo(text, nl=False)
    else:
        _write(file, text)
        tables.remark(f"wrote {file}")
    return tables.ExitStatus.DONE


def _check_new(path: Path) -> None:
    if path.exists():
        raise InvalidInputError(f"{path} exists; name another file", field="-o")


def _write(path: Path, text: str) -> None:
    _check_new(path)
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
