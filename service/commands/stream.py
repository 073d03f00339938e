"""The command that turns body wrenches into set-points, line by line."""

from __future__ import annotations

import sys
import textwrap
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import click
import msgspec

from hand_models.base import InvalidInputError, UnsupportedError
from service.commands.options import (
    FiniteRange,
    asked,
    hand_option,
    json_option,
    robot_option,
    stance_argument,
)
from service.commands.stances import read_request
from service.requests import PlanRequest, StreamRequest, Wrench
from service.tables import BAD_INPUT, DONE, EXIT_STATUS, FAILED, OVERLOADED, note, remark, say

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable
    from planner import RobotFile, WrenchStream
    from service.replies import ErrorReply, SetPointsReply

__all__ = ["stream"]

WORST_FIRST: Final = (BAD_INPUT, FAILED, OVERLOADED, DONE)
"""Exit statuses: that of a stream is the worst of its lines'."""

WIDTH: Final = 100
"""Columns that a line has at most."""

HANDS_A_LINE: Final = 4
"""Hands whose tensions fit in one line."""


@click.command()
@stance_argument
@click.option(
    "--radius",
    type=FiniteRange(min=0.0, min_open=True, max=1e4),
    default=30.0,
    show_default=True,
    help="Of interpolations along a force; along a moment a tenth of it, per metre [N].",
)
@hand_option
@robot_option
@json_option
def stream(
    stance: str,
    radius: float,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Give set-points for one body wrench after another: one a line in, one a line out.

    Each line of standard input is a JSON list of six numbers, a body wrench in B, force first
    [N, N·m]; blank lines are skipped. Plans are prepared first about the body wrench or the load of
    STANCE, whose wrists are to be fixed. A line that is no body wrench is told on standard error,
    with --json by an error in its place, and the next is read.

    Exit status: 2 where a line was bad, or else 1 where one failed, or else 3 where one is
    overloaded or infeasible.
    """
    from service.answering import opened, robots_of, set_points_reply

    if stance == "-":
        raise InvalidInputError(
            "standard input has the body wrenches; name a file or a bundled stance", field="STANCE"
        )
    request = _declared(asked(read_request(stance), hand, robot), radius)
    worst = DONE
    with opened(request, robots_of(robot)) as source:
        if not as_json:
            _say_columns(source)
        for number, line in enumerate(sys.stdin.buffer, start=1):
            if not line.strip():
                continue
            start = time.perf_counter()
            try:
                points = source.set_points(_body_wrench(line))
            except InvalidInputError as error:
                worst = BAD_INPUT
                if as_json:
                    say(_refused(error, number))
                else:
                    note(f"line {number}: {error}")
                continue
            reply = set_points_reply(stance, source, points, start)
            if as_json:
                say(reply)
            else:
                _say_line(reply)
            statuses = (worst, EXIT_STATUS.get(reply.status, FAILED))
            worst = min(statuses, key=WORST_FIRST.index)
    return worst


def _declared(plan: PlanRequest, radius: float) -> StreamRequest:
    """Return the declaration of a plan request's stance."""
    if plan.objective != "max_margin":
        raise UnsupportedError(
            f"{plan.objective} is not for streams; valid is max_margin", field="objective"
        )
    return StreamRequest(
        v=1,
        stance=plan.stance,
        body_wrench=plan.body_wrench,
        load=plan.load,
        limits=plan.limits,
        radius=radius,
    )


def _body_wrench(line: bytes) -> Wrench:
    """Return the body wrench of a line of JSON."""
    from service.wire import MalformedError

    try:
        wrench: Wrench = msgspec.json.decode(line, type=Wrench)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        wanted = "six finite numbers up to 1e6 as [fx, fy, fz, mx, my, mz] are wanted"
        raise MalformedError(f"{wanted}: {error}") from None
    return wrench


def _refused(error: InvalidInputError, number: int) -> ErrorReply:
    """Return what is said in place of a line's set-points."""
    from service.replies import ErrorDetail, ErrorReply

    field = f"line {number}" if error.field is None else f"line {number}: {error.field}"
    return ErrorReply(error=ErrorDetail(error.kind, field, error.message))


def _say_columns(stream: WrenchStream) -> None:
    """Write the header, and on standard error what the lines have in common."""
    from hand_models.hand import FINGERS

    radius = stream.interpolates
    how = "solved one by one about"
    if radius is not None:
        how = f"mixed within {radius:g} N, {radius / 10.0:g} N·m of"
    centre = ", ".join(f"{round(part, 1) + 0.0:.1f}" for part in stream.first)
    remark(
        f"plans are {how} the first centre [{centre}] N, N·m; "
        f"a hand's tensions are those of {', '.join(FINGERS)}"
    )
    head = f"{'status':<10} {'util':>6} {'gap':>5} {'source':<12}"
    _say_cells(head, [f"{limb[:11]} [N]" for limb in stream.limbs])


def _say_cells(head: str, cells: Sequence[str]) -> None:
    """Write what is told of each hand after what is told of all, in as few lines as fit."""
    for k in range(0, len(cells), HANDS_A_LINE):
        row = "".join(f" {cell:<15}" for cell in cells[k : k + HANDS_A_LINE])
        click.echo(f"{head if k == 0 else ' ' * len(head)}{row}".rstrip())


def _say_line(reply: SetPointsReply) -> None:
    """Write set-points in one line: each hand's four tensions, in whole newtons."""
    if reply.hands is None or reply.utilisation is None or reply.gap is None:
        head = f"{reply.status:<10} {'-':>6} {'-':>5} {reply.source:<12} "
        reason = textwrap.wrap(reply.reason or "", WIDTH - len(head))
        click.echo(head + f"\n{' ' * len(head)}".join(reason))
        return
    _say_cells(
        f"{reply.status:<10} {reply.utilisation:6.3f} {reply.gap:5.0e} {reply.source:<12}",
        ["/".join(f"{round(tension):3d}" for tension in hand.tensions) for hand in reply.hands],
    )
