"""The command that turns body wrenches into set-points, line by line."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Final

import click
import msgspec

from hand_models.errors import InvalidInputError, UnsupportedError
from hand_models.parameters import ParameterTable
from service.options import asked, hand_option, json_option, robot_option
from service.requests import PlanRequest, Wrench
from service.stances import read_request
from service.stream_messages import SetPointsReply, StreamRequest
from service.terminal import DONE, EXIT_STATUS, FAILED, OVERLOADED, say

if TYPE_CHECKING:
    from planner.robot_file import RobotFile

__all__ = ["stream"]

WORST_FIRST: Final = (FAILED, OVERLOADED, DONE)
"""Exit statuses: that of a stream is the worst of its set-points'."""


@click.command()
@click.argument("stance")
@click.option(
    "--radius",
    type=click.FloatRange(min=0.0, min_open=True, max=1e4),
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
    [N, N·m]. Plans are prepared first about the body wrench or the load of STANCE, whose wrists are
    to be fixed. The exit status is that of the worst of the set-points.
    """
    from service.own_robot import robots_of
    from service.streams import opened, set_points_reply

    if stance == "-":
        raise InvalidInputError(
            "standard input has the body wrenches; name a file or a bundled stance", field="STANCE"
        )
    request = _declared(asked(read_request(stance), hand, robot), radius)
    worst = DONE
    with opened(request, robots_of(robot)) as source:
        if not as_json:
            _say_columns(source.limbs)
        for wrench in _wrenches(sys.stdin.buffer):
            start = time.perf_counter()
            reply = set_points_reply(stance, source, source.set_points(wrench), start)
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


def _wrenches(lines: Iterable[bytes]) -> Iterator[Wrench]:
    """Yield the wrench of each line that is not empty, as soon as it is there."""
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            yield msgspec.json.decode(line, type=Wrench)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InvalidInputError(
                f"six numbers up to 1e6 as [fx, fy, fz, mx, my, mz] are wanted: {error}",
                field=f"line {number}",
            ) from None


def _say_columns(limbs: Iterable[str]) -> None:
    names = "".join(f"  {limb:<23}" for limb in limbs)
    click.echo(f"{'status':<10} {'util':>6} {'gap':>8} {'source':<12}{names}  tensions [N]")


def _say_line(reply: SetPointsReply) -> None:
    """Write set-points in one line: each hand's four tensions."""
    if reply.hands is None or reply.utilisation is None or reply.gap is None:
        click.echo(f"{reply.status:<10} {'-':>6} {'-':>8} {reply.source:<12}  {reply.reason}")
        return
    tensions = "".join(
        "  " + " ".join(f"{tension:5.1f}" for tension in hand.tensions) for hand in reply.hands
    )
    click.echo(
        f"{reply.status:<10} {reply.utilisation:6.3f} {reply.gap:8.1e} {reply.source:<12}{tensions}"
    )
