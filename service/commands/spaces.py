"""Commands that show what can be carried: by one hand, and by the whole body."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click
import msgspec

from service.commands.options import (
    asked,
    hand_option,
    json_option,
    limb_option,
    plot_option,
    robot_option,
    stance_argument,
)
from service.commands.stances import read_request
from service.requests import Axis, BodySpaceRequest, WrenchSpaceRequest
from service.tables import DONE, EXIT_STATUS, FAILED, OVERLOADED, progress, say, waiting, writing

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable
    from planner import RobotFile

__all__ = ["body_space", "wrench_space"]


@click.command("wrench-space")
@stance_argument
@limb_option
@plot_option("Draw it there.")
@click.option(
    "--search",
    "per_axis",
    type=click.IntRange(3, 25),
    metavar="N",
    help="Of a floating hand: search N^6 poses of its wrist, too.",
)
@click.option(
    "--robust", is_flag=True, help="And the least of it where the hand is a little elsewhere."
)
@robot_option
@json_option
def wrench_space(
    stance: str,
    limb_and_hand: tuple[str, ParameterTable | None],
    picture: Path | None,
    per_axis: int | None,
    robust: bool,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Show what one hand can carry."""
    from planner import floating_wrist, hand_space, survey
    from service import answering
    from service.answering import robots_of
    from service.replies import RobustCapability
    from service.tables import console, print_robust, print_survey, print_wrench_space, survey_json

    limb, hand = limb_and_hand
    robots = robots_of(robot)
    plan = asked(read_request(stance), hand, robot)
    request = WrenchSpaceRequest(v=1, stance=plan.stance, limb=limb)
    reply = answering.wrench_space(request, robots)
    if robust:
        alone = msgspec.structs.replace(request, want=["robust"])
        reply.robust = answering.wrench_space(alone, robots).robust
    found = None
    if per_axis is not None:
        wrist = floating_wrist(answering.stance(request.stance, robots), limb)
        with progress(f"{per_axis}^6 poses of {limb}") as tell:
            found = survey(wrist, per_axis, tell)
    if picture is not None:
        from planner import plot_wrench_space

        drawn = answering.stance(request.stance, robots)
        settled, space = hand_space(drawn, limb)
        shown, preload = space if reply.capability else None, None
        if reply.wrist.mode == "floating":
            preload = floating_wrist(drawn, limb).hand.preload
        with writing(picture):
            plot_wrench_space(
                settled,
                shown,
                picture,
                f"{limb} of {stance}",
                preload,
                outlined=reply.vertices is None,
            )
    if as_json:
        searched = {} if found is None else {"search": survey_json(found)}
        say(msgspec.to_builtins(reply) | searched)
    else:
        print_wrench_space(reply, console())
        if isinstance(reply.robust, RobustCapability) and reply.capability:
            print_robust(reply.robust, console())
        if found is not None:
            print_survey(found, console())
    return DONE if reply.capability else OVERLOADED


def _check_axes(_: click.Context, __: click.Parameter, given: str) -> list[Axis]:
    names = [name.strip() for name in given.split(",")]
    axes = [axis for name in names for axis in get_args(Axis) if axis == name]
    if len(names) != 2 or len(axes) != 2 or axes[0] == axes[1]:
        raise click.BadParameter(
            f"two different ones of {', '.join(get_args(Axis))} are wanted, as fx,fz; got {given}"
        )
    return axes


@click.command("body-space")
@stance_argument
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
    is_flag=True,
    help="Whatever the other components; as asked for by default.",
)
@click.option("--pure", is_flag=True, help="With the other components zero.")
@plot_option("Draw it there, and the largest accelerations in two planes.")
@hand_option
@robot_option
@json_option
def body_space(
    stance: str,
    axes: list[Axis],
    projection: bool,
    pure: bool,
    picture: Path | None,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Show what the body can bear: which wrenches, and which accelerations."""
    from service.tables import console, print_body_space

    if projection and pure:
        raise click.UsageError("give --projection or --pure, not both")
    from service.answering import explore, robots_of

    plan = asked(read_request(stance), hand, robot)
    request = BodySpaceRequest(
        v=1,
        id=plan.id,
        stance=plan.stance,
        body_wrench=plan.body_wrench,
        load=plan.load,
        limits=plan.limits,
        present=plan.present,
        axes=axes,
        others="free" if projection else "zero" if pure else "needed",
    )
    with waiting(f"exploring {stance}", plan):
        found = explore(request, robots_of(robot))
        if picture is not None:
            from planner import plot_body_space

            with writing(picture):
                plot_body_space(found.space, found.section, picture, stance)
    if as_json:
        say(found.reply)
    else:
        print_body_space(found.reply, console())
    return EXIT_STATUS.get(found.reply.status, FAILED)
