"""Print plans and routes as tables of text, in 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

from msgspec import UNSET
from rich.console import Console
from rich.text import Text

import planner
from service import replies
from service.tables.body_spaces import print_com_region
from service.tables.command_line import note_doubts, print_oddities
from service.tables.extras import (
    load_factor_words,
    palm_sentences,
    print_open_loop,
    print_spread,
    print_survival,
    robust_sentence,
    with_interval,
)
from service.tables.layout import (
    in_colour,
    in_order,
    joined,
    name,
    number,
    print_rows,
    print_warnings,
    short,
    text,
)

__all__ = ["print_plan", "print_route"]


def print_plan(
    reply: replies.PlanReply,
    out: Console,
    *,
    without_palm: planner.Plan | None = None,
    palm_parts: planner.PalmLoadFactors | None = None,
    brief: bool = False,
) -> None:
    """Print a plan: status, loads of hands, tendons, joint torques, and the extras of the reply.

    Extras are shadow prices, the infeasibility certificate, the spread over samples, robustness and
    clearance. The advice of the reply is not printed; see `print_advice`.

    Parameters
    ----------
    reply : PlanReply
        The plan.
    out : Console
        Console to print on.
    without_palm : Plan, optional
        Plan of the same question without palms, whose load factor is printed, too.
    palm_parts : PalmLoadFactors, optional
        Load factors without the palms' shear, and without their pressing, which are printed, too.
    brief : bool, optional
        True to print only the status, the reason and what is known of samples.
    """
    spread = reply.spread if isinstance(reply.spread, planner.Spread) else None
    known = [f"   {part}" for part in _first_line(reply, spread)]
    out.print(Text.assemble(in_colour(reply.status, reply.status.upper()), *known))
    if spread is not None:
        print_spread(spread, out)
    out.print(reply.reason)
    if brief:
        note_doubts(reply.findings)
        _print_displaced(reply, out)
        return
    print_warnings(reply.warnings, out)
    if reply.margin_share == 1.0:
        # less is among the warnings
        out.print("the margins that are kept if possible are kept in full")
    for limb, pose in (reply.poses or {}).items():
        where = ", ".join(f"{value:.4f}" for value in pose.position)
        turned = ", ".join(f"{value:.4f}" for value in pose.orientation)
        out.print(f"{limb} is at ({where}) m, ({turned}) [x, y, z, w]")
    if reply.path is not None:
        out.print(_path_sentence(reply.path))
    for sentence in palm_sentences(without_palm, palm_parts):
        out.print(sentence)
    _print_displaced(reply, out)
    if isinstance(reply.clearance, planner.Clearance):
        _print_clearance(reply.clearance, out)
    if isinstance(reply.com_region, replies.ComRegionReply):
        print_com_region(reply.com_region, out)
    if reply.hands is not None:
        _print_hands(reply.hands, out)
    if reply.joint_torque is not None and reply.joint_torque_limit is not None:
        _print_joints(reply.joint_torque, reply.joint_torque_limit, out)
    for prices, what in ((reply.prices, "utilisation"), (reply.effort_prices, "effort")):
        if prices:
            _print_prices(prices, what, out)
    if reply.certificate is not None:
        _print_certificate(reply.certificate, reply.body_wrench, out)


def _print_displaced(reply: replies.PlanReply, out: Console) -> None:
    """Print how a plan fares where hands are displaced, planned anew or executed as it is."""
    if isinstance(reply.robust, planner.RobustLoadFactor):
        out.print(robust_sentence(reply.robust))
    if isinstance(reply.open_loop, planner.OpenLoop):
        print_open_loop(reply.open_loop, out)
    if isinstance(reply.survival, planner.Survival):
        print_survival(reply.survival, out)


def _print_prices(prices: Sequence[planner.Price], what: str, out: Console) -> None:
    """Print the largest shadow prices."""
    columns = (
        name("hand", "limb"),
        name("finger, joint", lambda price: price.finger or price.joint),
        name("tile", "phalanx"),
        name("limit"),
        number("price", lambda price: f"{price.price:.2g} /{price.unit}"),
    )
    title = f"decrease of the {what} per unit of a limit"
    most = 8
    if len(prices) > most:
        title += f" ({most} of {len(prices)})"
    print_rows(prices[:most], columns, out, title)


def _first_line(reply: replies.PlanReply, spread: planner.Spread | None) -> Iterator[str]:
    """Yield the main numbers of a plan; intervals take the place of less important ones."""
    used, factor = (None, None) if spread is None else (spread.utilisation, spread.load_factor)
    if reply.utilisation is not None:
        yield f"utilisation {with_interval(reply.utilisation, used)}"
    if reply.load_factor is None:
        yield f"load factor {load_factor_words(reply)}"
    else:
        yield f"load factor {with_interval(reply.load_factor, factor)}"
    if spread is None:
        if reply.effort is not None:
            yield f"effort {reply.effort:.3g}"
        if isinstance(reply.reliability, planner.Reliability):
            yield (
                f"no tile slips (tiles alone, no common scatter) {reply.reliability.no_slip:.3g}"
            )
        yield f"{1e3 * reply.time.total:.0f} ms"


def _print_certificate(
    proof: replies.CertificateReply, needed: Sequence[float], out: Console
) -> None:
    """Print the missing wrench, the nearest one that is held, and the limits in the way."""
    if proof.shortfall is not None and proof.nearest is not None:
        where = "at any utilisation"
        if proof.utilisation is not None:
            where = f"up to a utilisation of {proof.utilisation:g}"
        rows = (
            ("needed", *needed),
            ("nearest held", *proof.nearest),
            ("missing", *proof.shortfall),
        )
        columns = in_order([""], replies.WRENCH_AXES, form="z.1f")
        print_rows(rows, columns, out, f"body wrenches {where}, in B [N, N·m]")
    if proof.irreducible:
        title = "these leave no balance, each needed for that; others may be in the way, too"
        alike = [(*names, ", ".join(of) or "-") for names, of in _alike(proof.irreducible).items()]
        print_rows(alike, in_order(("hand", "limit"), texts=["of"]), out, title)
        words = {each.limit: planner.constraint_words(each) for each in proof.irreducible}
        for limit, said in words.items():
            out.print(f"{limit}: {said}")
        if proof.sufficient is not None:
            out.print()
            out.print(_sufficient_sentence(proof.sufficient))


def _sufficient_sentence(names: Sequence[planner.LimitName]) -> str:
    """Return in a sentence which single limits, removed, would make the stance feasible."""
    if not names:
        return "removing no single one of them would make it feasible"
    which = "this one" if len(names) == 1 else "any one of these"
    limits = ", ".join(
        f"{limb} {limit}" + (f" ({', '.join(owners)})" if owners else "")
        for (limb, limit), owners in _alike(names).items()
    )
    return f"removing {which} would make it feasible: {limits}"


def _alike(names: Iterable[planner.LimitName]) -> dict[tuple[str, str], list[str]]:
    """Return limits by limb and kind, in their order, with the parts of the limb that have them."""
    alike: dict[tuple[str, str], list[str]] = {}
    for each in names:
        parts = (each.phalanx, each.finger, each.joint)
        whose = " of ".join(part for part in parts if part is not None)
        owners = alike.setdefault((each.limb, each.limit), [])
        owners += [whose] if whose else []
    return alike


def _path_sentence(path: planner.TensionPath) -> str:
    """Return in a sentence how the path from the present tensions is."""
    used = path.utilisation_at_present
    there = "no balance" if used is None else f"utilisation {used:.3f}"
    way = "safe" if path.safe else "not safe"
    return f"from the present tensions ({there}): changes up to {path.largest_change:.1f} N, {way}"


def _print_hands(hands: Sequence[replies.HandReply], out: Console) -> None:
    """Print the load of each hand, the twist of floating wrists, and the tendons of each finger."""
    columns = (
        name("hand", "limb"),
        *(
            number(axis, f"wrench.{i}", partial(short, digits=i // 3))
            for i, axis in enumerate(replies.WRENCH_AXES)
        ),
        number("hand\nutil", "utilisation", partial(short, digits=2)),
        number("palm\nshear", "palm.force.0", partial(short, digits=0), scale=-1.0),
        number("palm\npress", "palm.force.2", partial(short, digits=0)),
    )
    print_rows(hands, columns, out, "wrench on the rock, in H [N, N·m], and the palm's part")
    turns = [*enumerate(("vx", "vy", "vz", "wx", "wy", "wz"))]
    floating = [hand for hand in hands if hand.wrist.twist is not None]
    if floating:
        title = "where wrists go (mm, mrad), and how their palms carry"
        columns = (
            name("hand", "limb"),
            *(number(axis, f"wrist.twist.{i}", "z.2f", scale=1e3) for i, axis in turns),
            text("palm", "wrist.palm", lambda palm: palm.replace("_", " ")),
        )
        print_rows(floating, columns, out, title)
    aimed = [hand for hand in floating if hand.wrist.pose_target is not UNSET]
    if aimed:
        title = "where limbs are to aim (mm, mrad), and the least stiffness there"
        columns = (
            name("hand", "limb"),
            *(number(axis, f"wrist.pose_target.{i}", "z.2f", scale=1e3) for i, axis in turns),
            number("N/mm", "wrist.least_stiffness", ".1f", scale=1e-3),
        )
        print_rows(aimed, columns, out, title)
    fingers = [(hand.limb, finger, _worst(finger)) for hand in hands for finger in hand.fingers]
    title = "tendons and their motors, and each finger's most loaded tile"
    columns = (
        name("hand", "0"),
        name("finger", "1.name"),
        number("tension N", "1.tendon_tension", ".1f"),
        number("current A", "1.motor_current", ".3f"),
        text("tile", "2.phalanx"),
        number("util", "2.utilisation", ".2f"),
    )
    print_rows(fingers, columns, out, title, groups=True)


def _worst(finger: Any) -> Any:
    """Return a finger's most loaded tile; None where none touches."""
    touching = [tile for tile in finger.tiles if tile.contact != "none"]
    return max(touching, key=attrgetter("utilisation"), default=None)


def _print_joints(
    torques: Mapping[str, Sequence[float]], limits: Mapping[str, Sequence[float]], out: Console
) -> None:
    """Print each limb's joint torques, in lines that fit, with the utilisation of its joints.

    The joint with the largest utilisation is marked.
    """
    most = max((len(row) for row in torques.values()), default=0)
    # so many torques fit in one line
    width = min(most, 7)
    rows: list[list[str]] = []
    for limb, row in torques.items():
        # a joint without a motor has no torque and a limit of zero
        pairs = zip(row, limits[limb], strict=True)
        used = [abs(torque) / (limit or math.inf) for torque, limit in pairs]
        worst = used.index(max(used))
        cells = [
            f"{torque:z.{0 if abs(torque) >= 1e3 else 1}f}" + ("*" if i == worst else " ")
            for i, torque in enumerate(row)
        ]
        for start in range(0, len(cells), width):
            line = [*cells[start : start + width], *[""] * width][:width]
            ends = (f"{limits[limb][worst]:.4g}", f"{used[worst]:.2f}") if start == 0 else ("", "")
            rows.append([f"  from {start + 1}" if start else limb, *line, *ends])
    heads = [f"{'+' if most > width else ''}{i + 1}" for i in range(width)]
    columns = in_order(["limb"], [*heads, "of", "util"])
    title = "joint torques [N·m], from the body outward; * most of its limit"
    # with padding, seven torques do not fit
    print_rows(rows, columns, out, title, padding=0)


def _print_clearance(clearance: planner.Clearance, out: Console) -> None:
    """Print the least distances, and the parts that were not measured."""
    pairs = ("link_rock", "link_link", "hand_hand", "hand_body", "body_rock")
    near = {pair.replace("_", " "): getattr(clearance, pair) for pair in pairs}
    title = "least distances; below zero: how deep one is in the other"
    columns = (
        name("", "0"),
        number("mm", "1.distance", ".0f", scale=1e3),
        text("between", "1.between.0"),
        text("and", "1.between.1"),
    )
    print_rows([row for row in near.items() if row[1] is not None], columns, out, title)
    for missing in clearance.unchecked:
        out.print(f"not measured: {missing}")


def print_route(
    result: planner.RouteResult,
    files: Mapping[str, Path],
    out: Console,
    climb: planner.Climb | None = None,
) -> None:
    """Print a route: each stage, each move and what fails, the crux, and the written files.

    Parameters
    ----------
    result : RouteResult
        Plans of all stages.
    files : mapping of str to Path
        Written files, by what they contain.
    out : Console
        Console to print on.
    climb : Climb, optional
        Knots of the climb, for its moves.
    """
    out.print(Text.assemble((result.route.name, "bold"), f": {len(result.route.moves)} moves"))
    numbers = {"util": "utilisation", "load factor": "load_factor", "joints": "joint_utilisation"}
    if all(plan.joint_utilisation is None for plan in result.plans):
        del numbers["joints"]
    columns = (
        name("", lambda row: "crux" if row[0].index == result.crux else ""),
        *(name(part, f"0.{part}") for part in ("move", "phase", "limb")),
        name("status", lambda row: in_colour(row[1].status)),
        *(number(head, f"1.{part}", ".2f") for head, part in numbers.items()),
    )
    stages = zip(result.stages, result.plans, strict=True)
    print_rows(
        stages, columns, out, style=lambda row: "bold" if row[0].index == result.crux else ""
    )
    summary = planner.summary(result, climb)
    if climb is not None:
        _print_moves(summary["climb"], out)
        if climb.failure is not None and not climb.fails:
            out.print(
                'The route has no joints, and its stages are planned without; with "joints": '
                '"solve" in its stance they are planned with those of the climb.'
            )
    findings = [each for plan in result.plans for each in plan.findings]
    print_oddities(summary["warnings"], findings, out)
    out.print(summary["crux"]["sentence"])
    for what, path in files.items():
        out.print(f"{what}: {path}", soft_wrap=True)


def _print_moves(climb: Mapping[str, Any], out: Console) -> None:
    """Print the moves of a climb's summary, and why it fails."""
    columns = (
        name("move", lambda row: str(row["move"] or "start")),
        name("limb"),
        number("time [s]", "time", ".1f"),
        number("knots"),
        number("util", "utilisation", ".2f"),
        number("bound", "bound", ".2f"),
        text("limited by", lambda row: joined(*(row["limiting"] or {}).values()) or None),
    )
    title = f"moves: {climb['knots']} knots, {climb['time']:.1f} s long"
    print_rows(climb["moves"], columns, out, title)
    if (failure := climb["failure"]) is not None:
        what = f"move {failure['move']} fails ({failure['phase']})"
        out.print(Text.assemble((f"{what}:", "bold red"), f" {failure['reason']}"))
