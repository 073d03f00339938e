"""Define ``crux wrench-space`` of one hand, ``crux body-space``, and ``crux screen`` of stances."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click
import msgspec
from click.core import ParameterSource

import planner
from hand_models.base import InvalidInputError
from service import answering, climbs, replies, requests, tables
from service.commands import options, stances
from service.commands.declaring import argument, command, flag, option

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable

__all__ = ["body_space_command", "screen_command", "wrench_space_command"]


@command("wrench-space")
def wrench_space_command(
    stance: str = options.stance_argument,
    limb_and_hand: tuple[str, ParameterTable | None] = options.limb_option,
    picture: Path | None = options.plot_option("Draw it there."),
    per_axis: int | None = option(
        "Of a floating hand: search N^6 poses of its wrist, too.",
        click.IntRange(3, 25),
        usage="--search N",
    ),
    robust: bool = flag("And the least of it where the hand is a little elsewhere."),
    opening: bool = flag("And how the hand lets go of its hold; --plot draws this."),
    robot: planner.RobotFile | None = options.robot_option,
    as_json: bool = options.json_option,
) -> int:
    """Show what one hand can carry."""
    limb, hand = limb_and_hand
    own = options.Own(hand, robot)
    robots = own.robots
    plan = own.asked(stances.read_request(stance))
    request = requests.WrenchSpaceRequest(v=1, stance=plan.stance, limb=limb)
    reply = answering.answer_wrench_space(request, robots)
    if robust:
        alone = msgspec.structs.replace(request, want=["robust"])
        reply.robust = answering.answer_wrench_space(alone, robots).robust
    if opening:
        alone = msgspec.structs.replace(request, want=["opening"])
        reply.opening = answering.answer_wrench_space(alone, robots).opening
    found = None
    if per_axis is not None:
        wrist = planner.floating_wrist(answering.stance(request.stance, robots), limb)
        with tables.progress(f"{per_axis}^6 poses of {limb}") as report:
            found = planner.survey(wrist, per_axis, report)
    if picture is not None:
        drawn, title = answering.stance(request.stance, robots), f"{limb} of {stance}"
        settled, space = planner.hand_space(drawn, limb)
        shown, preload = space if reply.capability else None, None
        if reply.wrist.mode == "floating":
            preload = planner.floating_wrist(drawn, limb).hand.preload
        outlined = reply.vertices is None
        with tables.writing(picture):
            if opening:
                from hand_models.opening import opening_path

                planner.plot_opening(opening_path(settled), picture, title)
            else:
                planner.plot_wrench_space(
                    settled, shown, picture, title, preload, outlined=outlined
                )
    if as_json:
        searched = {} if found is None else {"search": tables.survey_json(found)}
        tables.say(msgspec.to_builtins(reply) | searched)
    else:
        out = tables.console()
        tables.print_wrench_space(reply, out)
        if isinstance(reply.robust, replies.RobustCapability) and reply.capability:
            tables.print_robust(reply.robust, out)
        if isinstance(reply.opening, replies.OpeningReply):
            tables.print_opening(reply.opening, out)
        if found is not None:
            tables.print_survey(found, out)
    return tables.ExitStatus.DONE if reply.capability else tables.ExitStatus.OVERLOADED


def _check_axes(_: click.Context, __: click.Parameter, given: str) -> list[requests.Axis]:
    """Return two different axes of a wrench."""
    known, names = get_args(requests.Axis), [name.strip() for name in given.split(",")]
    axes = [axis for name in names for axis in known if axis == name]
    if len(names) != 2 or len(axes) != 2 or axes[0] == axes[1]:
        raise click.BadParameter(
            f"two different ones of {', '.join(known)} are wanted, as fx,fz; got {given}"
        )
    return axes


def _shaken(load: planner.Load | None, shake: float | None) -> list[tuple[float, float, float]]:
    """Return accelerations along ± each axis of W, added to that of the load."""
    if shake is None:
        return []
    x, y, z = (load or planner.Load()).acceleration
    return [
        accelerated
        for by in (shake, -shake)
        for accelerated in ((x + by, y, z), (x, y + by, z), (x, y, z + by))
    ]


@command("body-space")
def body_space_command(
    stance: str = options.stance_argument,
    axes: list[requests.Axis] = option(
        "Of the plane of body wrenches that is shown: fx, fy, fz, mx, my or mz, in B.",
        default="fx,fz",
        callback=_check_axes,
        usage="AXIS,AXIS",
    ),
    projection: bool = flag("Whatever the other components; as asked for by default."),
    pure: bool = flag("With the other components zero."),
    com: bool = flag("Show instead where the centre of mass may be."),
    shake: float | None = option(
        "With --com, in three dimensions: under accelerations of A m/s² along ± each axis of W.",
        options.FiniteRange(0.0, 1e2, min_open=True),
        usage="A",
    ),
    picture: Path | None = options.plot_option(
        "Draw it there, and the largest accelerations in two planes."
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Show what the body can bear: which wrenches, and which accelerations.

    With --shake, exit status 3 also where the centre of mass is not held under all of them.
    """
    if projection and pure:
        raise click.UsageError("give --projection or --pure, not both")
    if shake is not None and not com:
        raise click.UsageError("--shake requires --com")
    if com:
        context = click.get_current_context()
        for name in ("axes", "projection", "pure"):
            if context.get_parameter_source(name) is not ParameterSource.DEFAULT:
                raise click.UsageError(f"--{name} is of a plane of body wrenches: not with --com")

    plan = own.asked(stances.read_request(stance))
    request = requests.BodySpaceRequest(
        v=1,
        id=plan.id,
        stance=plan.stance,
        body_wrench=plan.body_wrench,
        load=plan.load,
        limits=plan.limits,
        present=plan.present,
        axes=axes,
        others="free" if projection else "zero" if pure else "needed",
        want=["com_region"] if com else [],
        com_accelerations=_shaken(plan.load, shake),
    )
    # that of the load is one of them
    accelerations = 0 if shake is None else 1 + len(request.com_accelerations)
    with tables.waiting(f"exploring {stance}", plan):
        found = answering.explore(request, own.robots)
        if picture is not None:
            with tables.writing(picture):
                if found.region is None:
                    planner.plot_body_space(found.space, found.section, picture, stance)
                else:
                    planner.plot_com_region(
                        found.space, found.region, picture, stance, found.solid, accelerations
                    )
    if as_json:
        tables.say(found.reply)
    else:
        tables.print_body_space(found.reply, tables.console(), accelerations)
    falls = accelerations > 0 and (found.solid is None or found.solid.margin < 0.0)
    return tables.ExitStatus.of(found.reply.status, fails=falls)


@command("screen")
def screen_command(
    candidates: str = argument(),
    best: int = option(
        "Plan the best N, and prove that no other is better.",
        click.IntRange(min=1),
        default=1,
        usage="N",
    ),
    within: str = option(
        "Plan also all whose load factor may be within this part of the best, as 5% or 0.05.",
        default="0",
        usage="PART",
        show_default=False,
    ),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Rank stances by their load factors; solve only those that may be the best.

    CANDIDATES is the path of a file of JSON lines as crux batch takes it, - for standard input, or
    a folder: all files in it that end in .json or .toml. Hands have fixed wrists. Supports of the
    hands bound all load factors from above; programs are solved only of stances whose bound is
    above the best ones known.

    Exit status: 0 if a stance has a load factor, 3 if none has, 2 if none can be read.
    """
    part = climbs.part_of_whole(within, "--within")
    if part >= 1.0:
        raise InvalidInputError(f"must be less than 100 %, got {within!r}", field="--within")
    names, questions, wrong = [], [], dict[str, str]()
    first: InvalidInputError | None = None
    for name, request in stances.read_candidates(candidates):
        try:
            if isinstance(request, InvalidInputError):
                raise request
            questions.append(answering.question(own.asked(request), own.robots))
            names.append(name)
        except InvalidInputError as error:
            first, wrong[name] = first or error, str(error)
    if first is not None and not names:
        raise InvalidInputError(f"{next(iter(wrong))}: {first.message}", field=first.field)
    with tables.working(f"screening {len(names)} stances"):
        found = planner.screen(questions, best=best, within=part)
    wrong |= {names[i]: fault for i, fault in found.faults.items()}
    if as_json:
        tables.say(tables.screening_json(found, names, wrong))
    else:
        tables.print_screening(found, names, tables.console())
        tables.note_faults(wrong)
    return tables.ExitStatus.DONE if len(found.best) else tables.ExitStatus.OVERLOADED
