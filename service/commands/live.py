"""Define commands that go on: ``crux stream`` and ``play`` give set-points, ``view`` a page."""

from __future__ import annotations

import signal
import sys
import textwrap
import time
import webbrowser
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click
import msgspec

import planner
from hand_models.base import InvalidInputError, Strict, UnsupportedError
from service import answering, bulk, replies, requests, serving, tables, viewing, wire
from service.commands import options, stances
from service.commands.declaring import argument, command, flag, option
from service.commands.network import zenoh_options

if TYPE_CHECKING:
    import zenoh

__all__ = ["play_command", "stream_command", "view_command"]


@command("stream")
def stream_command(
    stance: str = options.stance_argument,
    radius: float = option(
        "Of interpolations along a force; along a moment a tenth of it, per metre [N].",
        options.FiniteRange(min=0.0, min_open=True, max=1e4),
        default=30.0,
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Give set-points for one body wrench after another, read line by line.

    Each line of standard input is a JSON list of six numbers, a body wrench in B, force first
    [N, N·m]; or an object {"body_wrench": [...], "lost": [...]} with all tiles that have slipped,
    each {"limb", "finger", "phalanx"}. Blank lines are skipped. Plans are prepared first about the
    body wrench or the load of STANCE; with compliant wrists each line is solved by itself, and only
    --json has their poses. Floating wrists are refused. A line that is no body wrench is reported
    on standard error, with --json by an error in its place, and the next line is read. What is odd
    about STANCE, and a unit or a direction of a line that is in doubt, is said there once. Below
    set-points without lost tiles, or beyond the cap, are the hand to save first, the fingers taken
    off the rock, and the reason.

    Exit status: 2 where a line was bad, or else 1 where one failed, or else 3 where one is
    overloaded or infeasible.
    """
    if stance == "-":
        raise InvalidInputError(
            "standard input has the body wrenches; name a file or a bundled stance", field="STANCE"
        )
    request = _declared(own.asked(stances.read_request(stance)), radius)
    status = tables.ExitStatus
    worst_first = (status.BAD_INPUT, status.FAILED, status.OVERLOADED, status.DONE)
    worst = status.DONE
    with answering.opened(request, own.robots) as source:
        if not as_json:
            width = tables.console().width
            _say_columns(source, width)
        for each in source.findings:
            (tables.note if each.doubts_number else tables.remark)(f"warning: {each.message}")
        doubted = {(each.kind, each.unit) for each in source.findings if each.doubts_number}
        for number, line in enumerate(sys.stdin.buffer, start=1):
            if not line.strip():
                continue
            start = time.perf_counter()
            try:
                asked = _line(line)
                points = source.set_points(asked.body_wrench, asked.lost)
            except InvalidInputError as error:
                worst = status.BAD_INPUT
                if as_json:
                    tables.say(_refused(error, number))
                else:
                    tables.note(f"line {number}: {error}")
                continue
            reply = answering.set_points_reply(stance, source, points, start)
            for each in points.findings:
                if (each.kind, each.unit) not in doubted:
                    tables.note(f"line {number}: warning: {each.message}")
                    doubted.add((each.kind, each.unit))
            if as_json:
                tables.say(reply)
            else:
                _say_line(reply, width)
            worst = min(worst, status.of(reply.status), key=worst_first.index)
    return worst


@command("view")
def view_command(
    stance: str = options.stance_argument,
    output: Path | None = option(
        "Where the page's button saves the moved stance; by default STANCE-moved.json.",
        options.OutputFile(".json"),
        usage="-o --output FILE",
    ),
    port: int = option(
        "Of the page, on this machine; by default any that is free.",
        click.IntRange(0, 65535),
        default=0,
        usage="PORT",
        show_default=False,
    ),
    no_browser: bool = flag("Print the page's address, and open no browser."),
    follow: bool = flag("Show the set-points and slips that a service publishes."),
    config: zenoh.Config = zenoh_options,
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Open a page to drag the body and the hands on their rock; the plan follows. Ctrl-C ends it.

    Only browsers of this machine that have the whole address, with its token, are answered. Zenoh's
    flags count with --follow alone. --json prints the address as JSON.
    """
    request, given = stances.read_with_text(stance)
    name = "stance" if stance == "-" else Path(stance).stem
    file = output or Path(f"{name}-moved.json")
    tables.write_alone(file)
    with tables.waiting(f"planning {stance}", request):
        movable = viewing.MovableStance(own.asked(request), own.robots)
        live = viewing.LivePlan(movable, name, file, given)
        live.prepare()
    with ExitStack() as ends:
        streams = None
        if follow:
            serving.start_zenoh_log()
            session = ends.enter_context(serving.open_session(config))
            robot = request.stance.robot or wire.DEFAULT_ROBOT
            streams = viewing.FollowedStreams(session, robot)
        try:
            server = ends.enter_context(viewing.LiveServer(live, port, streams))
        except OSError as error:
            raise InvalidInputError(
                f"port {port} cannot be had: {error.strerror}; name another", field="--port"
            ) from None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
        try:
            if as_json:
                tables.say({"v": 1, "address": server.address})
            else:
                click.echo(server.address)
            if not no_browser and not webbrowser.open(server.address):
                tables.remark("no browser was found: open the address in one")
            tables.remark("Ctrl-C ends it")
            server.serve_forever()
        except KeyboardInterrupt:
            tables.remark("ended")
        finally:
            live.close()
    return tables.ExitStatus.DONE


@command("play")
def play_command(
    folder: Path = argument(options.ANY_PATH, metavar="DIR"),
    config: zenoh.Config = zenoh_options,
    rate: float = option(
        "Least number of set-points in a second.",
        options.FiniteRange(1.0, 1e4),
        default=100.0,
        usage="HZ",
    ),
    speed: float = option(
        "Time of the climb over time that passes; 1 keeps the controller's rates.",
        options.FiniteRange(0.0, min_open=True, max=100.0),
        default=1.0,
    ),
    up_to_failure: bool = flag("Play a climb that ends in the middle, too."),
    wait: float | None = option(
        "Wait so long for a subscriber, the robot's controller; by default "
        f"{serving.SERVING_SETTINGS.search_timeout:g}.",
        options.FiniteRange(0.0, 1e6),
        usage="SECONDS",
    ),
    as_json: bool = options.json_option,
) -> None:
    """Send the set-points of a climb to a robot: publish them in time, until the end or Ctrl-C.

    DIR is what crux route has written. Between knots, set-points are interpolated. Each is a
    message at crux/<robot>/play; the last one comes again with the state done, or stopped. The
    robot has to be at the start of the climb.
    """
    knots, about = bulk.read_climb(folder)
    failure = about.climb.failure
    if failure is not None and not up_to_failure:
        raise InvalidInputError(
            f"{folder}: the climb fails in move {failure.move} ({failure.phase}): "
            f"{failure.reason}; --up-to-failure plays what comes before",
            field="DIR",
        )
    if unsure := [knot.index for knot in knots if not knot.verified]:
        raise InvalidInputError(f"{folder}: knot {unsure[0]} is not verified", field="DIR")
    duration = knots[-1].time - knots[0].time
    if not as_json:
        tables.remark(f"playing {about.route}: {len(knots)} knots in {duration / speed:.1f} s")
        if speed > 1.0:
            tables.note(f"at speed {speed:g}, tensions and joints exceed the controller's rates")
    serving.start_zenoh_log()
    with serving.open_session(config) as session:
        delays = [0.0]
        sent = serving.play(
            session, about.robot, knots, rate=rate, speed=speed, wait=wait, late=delays.append
        )
    # a controller hardly feels less than a period, or 10 ms
    if not as_json and max(delays) > max(1.0 / rate, 0.01):
        tables.note(
            f"set-points were late, one of them by {1e3 * max(delays):.0f} ms: the climb took "
            f"{sum(delays):.2f} s longer; try a lower --rate, or a machine with less to do"
        )
    if as_json:
        tables.say({"v": 1, "set_points": sent, "knots": len(knots), "time": duration})
    else:
        tables.console().print(f"{sent} set-points of {len(knots)} knots were published")


def _declared(plan: requests.PlanRequest, radius: float) -> requests.StreamRequest:
    """Return the declaration of a plan request's stance."""
    if plan.objective != "max_margin":
        raise UnsupportedError(
            f"{plan.objective} is not available for streams; valid is max_margin", field="objective"
        )
    return requests.StreamRequest(
        v=1,
        stance=plan.stance,
        body_wrench=plan.body_wrench,
        load=plan.load,
        limits=plan.limits,
        radius=radius,
    )


class _Line(Strict, frozen=True):
    """A line of standard input: body wrench, and tiles that have slipped."""

    body_wrench: requests.Wrench
    lost: requests.LostTiles = msgspec.field(default_factory=list)


def _line(line: bytes) -> _Line:
    """Return what a line of JSON asks for."""
    if line.lstrip().startswith(b"{"):
        return wire.decode_request(line, _Line)
    try:
        wrench: requests.Wrench = msgspec.json.decode(line, type=requests.Wrench)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        wanted = "six finite numbers up to 1e6 as [fx, fy, fz, mx, my, mz] are wanted"
        raise wire.MalformedError(f"{wanted}: {error}") from None
    return _Line(body_wrench=wrench)


def _refused(error: InvalidInputError, number: int) -> replies.ErrorReply:
    """Return the error reply in place of a line's set-points."""
    field = f"line {number}" if error.field is None else f"line {number}: {error.field}"
    return replies.ErrorReply(error=replies.ErrorDetail(error.kind, field, error.message))


def _say_columns(stream: planner.WrenchStream, width: int) -> None:
    """Write the header; write the centre and the hands' order on standard error."""
    from hand_models.hand import FINGERS

    radius = stream.interpolates
    how = "solved one by one about"
    if radius is not None:
        how = f"mixed within {radius:g} N, {radius / 10.0:g} N·m of"
    centre = ", ".join(f"{round(part, 1) + 0.0:.1f}" for part in stream.first)
    tables.remark(
        f"plans are {how} the first centre [{centre}] N, N·m; "
        f"a hand's tensions are those of {', '.join(FINGERS)}"
    )
    head = f"{'status':<10} {'util':>6} {'gap':>5} {'source':<12}"
    _say_cells(head, [f"{limb[:11]} [N]" for limb in stream.limbs], width)


def _say_cells(head: str, cells: Sequence[str], width: int) -> None:
    """Write the cells of the hands after the head, in as few lines as fit."""
    row = head
    for cell in cells:
        padded = f" {cell:<15}"
        if len(row + padded.rstrip()) > width and row.strip():
            click.echo(row.rstrip())
            row = " " * len(head)
        row += padded
    click.echo(row.rstrip())


def _say_line(reply: replies.SetPointsReply, width: int) -> None:
    """Write set-points: each hand's four tensions, in whole newtons, and what a slip leaves."""
    said, under = "; ".join(_remarks(reply)), " " * 11  # under the status
    if reply.hands is None or reply.utilisation is None or reply.gap is None:
        head = f"{reply.status:<10} {'-':>6} {'-':>5} {reply.source:<12} "
        click.echo(textwrap.fill(said, width, initial_indent=head, subsequent_indent=under))
        return
    _say_cells(
        f"{reply.status:<10} {reply.utilisation:6.3f} {reply.gap:5.0e} {reply.source:<12}",
        ["/".join(f"{round(tension):3d}" for tension in hand.tensions) for hand in reply.hands],
        width,
    )
    if said:
        click.echo(textwrap.fill(said, width, initial_indent=under, subsequent_indent=under))


def _remarks(reply: replies.SetPointsReply) -> Iterator[str]:
    """Yield what to do after slips or under an overload, and why."""
    if reply.save_first:
        yield f"save {reply.save_first} first"
    if reply.released:
        yield f"released: {', '.join(f'{each.limb} {each.finger}' for each in reply.released)}"
    elif reply.lost:
        yield "released: none"
    if reply.reason:
        yield reply.reason
