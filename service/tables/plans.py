"""Replies as tables for a person, in 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from operator import attrgetter
from typing import Any, Final

from rich.console import Console
from rich.markup import escape

import planner
from service import replies
from service.tables.extras import robust_sentence, spread_sentence, within
from service.tables.layout import (
    in_colour,
    in_order,
    name,
    number,
    print_rows,
    short,
    text,
    unit_of,
)

__all__ = ["print_plan", "print_robust", "print_wrench_space"]

MOST_PRICES: Final = 8
"""Prices shown; the dearest first."""

NEARLY: Final = 0.02
"""Turns of joints that are told where the rock is a little elsewhere; less is not much [rad]."""

JOINTS_A_LINE: Final = 7
"""Joint torques of a limb in one line of a table."""

HANDS: Final = (
    name("hand", "limb"),
    *(
        number(axis, f"wrench.{i}", partial(short, digits=i // 3))
        for i, axis in enumerate(replies.AXES)
    ),
    number("hand\nutil", "utilisation", partial(short, digits=2)),
    number("palm\nshear", "palm.force.0", partial(short, digits=0), scale=-1.0),
    number("palm\npress", "palm.force.2", partial(short, digits=0)),
)
TURNS: Final = ("vx", "vy", "vz", "wx", "wy", "wz")
WRISTS: Final = (
    name("hand", "limb"),
    *(number(axis, f"wrist.twist.{i}", "z.2f", scale=1e3) for i, axis in enumerate(TURNS)),
    text("palm", "wrist.palm", lambda palm: palm.replace("_", " ")),
)
FINGERS: Final = (
    name("hand", "0"),
    name("finger", "1.name"),
    number("tension N", "1.tendon_tension", ".1f"),
    number("current A", "1.motor_current", ".3f"),
    text("tile", "2.phalanx"),
    number("util", "2.utilisation", ".2f"),
)
TENSION_LIMITS: Final = (
    name("finger"),
    name("phalanx"),
    number("f_t(max) N", lambda limit: "none" if limit.tension is None else f"{limit.tension:.1f}"),
)
PRICES: Final = (
    name("hand", "limb"),
    name("finger, joint", lambda price: price.finger or price.joint),
    name("tile", "phalanx"),
    name("limit"),
    number("price", lambda price: f"{price.price:.2g} /{price.unit}"),
)
CLEARANCES: Final = (
    name("", "0"),
    number("mm", "1.distance", ".0f", scale=1e3),
    text("between", "1.between.0"),
    text("and", "1.between.1"),
)

CARRIES: Final[Mapping[str, str]] = {
    "off": "carries nothing",
    "drags": "drags on the rock",
    "presses": "presses on the rock",
    "drags_and_presses": "drags and presses on the rock",
}
"""What a palm does in each of its modes."""


def print_plan(
    reply: replies.PlanReply,
    out: Console,
    *,
    without_palm: replies.PlanReply | None = None,
    brief: bool = False,
) -> None:
    """Print a plan, but for the advice.

    Parameters
    ----------
    reply : PlanReply
    out : Console
    without_palm : PlanReply, optional
        The same question's answer with every palm left out.
    brief : bool, optional
        Whether its status and reason are all.
    """
    spread = reply.spread if isinstance(reply.spread, planner.Spread) else None
    out.print("   ".join(_first_line(reply, spread)))
    if spread is not None:
        out.print(spread_sentence(spread), markup=False)
    out.print(reply.reason, markup=False)
    if brief:
        return
    for warning in reply.warnings:
        out.print(f"[bold]warning:[/bold] {escape(warning)}")
    for limb, pose in (reply.poses or {}).items():
        where = ", ".join(f"{value:.4f}" for value in pose.position)
        turned = ", ".join(f"{value:.4f}" for value in pose.orientation)
        out.print(f"{limb} is at ({where}) m, ({turned}) [x, y, z, w]", markup=False)
    if reply.path is not None:
        out.print(_path_sentence(reply.path), markup=False)
    if without_palm is not None:
        out.print(f"load factor without the palms: {_load_factor(without_palm)}")
    if isinstance(reply.robust, planner.RobustLoadFactor):
        out.print(robust_sentence(reply.robust), markup=False)
    if isinstance(reply.clearance, planner.Clearance):
        _print_clearance(reply.clearance, out)
    if reply.hands is not None:
        _print_hands(reply.hands, out)
    if reply.joint_torque is not None and reply.joint_torque_limit is not None:
        _print_joints(reply.joint_torque, reply.joint_torque_limit, out)
    for prices, what in ((reply.prices, "utilisation"), (reply.effort_prices, "effort")):
        if prices:
            title = f"what one unit more of a limit would take off the {what}"
            if len(prices) > MOST_PRICES:
                title += f" ({MOST_PRICES} of {len(prices)})"
            print_rows(prices[:MOST_PRICES], PRICES, out, title)
    if reply.certificate is not None:
        _print_certificate(reply.certificate, reply.body_wrench, out)


def _first_line(reply: replies.PlanReply, spread: planner.Spread | None) -> Iterator[str]:
    """Yield what is most to be known of a plan; intervals of it in place of lesser things."""
    yield in_colour(reply.status, reply.status.upper())
    used, factor = (None, None) if spread is None else (spread.utilisation, spread.load_factor)
    if reply.utilisation is not None:
        yield f"utilisation {within(reply.utilisation, used)}"
    if reply.load_factor is None:
        yield f"load factor {_load_factor(reply)}"
    else:
        yield f"load factor {within(reply.load_factor, factor)}"
    if spread is None:
        if reply.effort is not None:
            yield f"effort {reply.effort:.3g}"
        yield f"{1e3 * reply.time.total:.0f} ms"


def print_wrench_space(reply: replies.WrenchSpaceReply, out: Console) -> None:
    """Print what one hand can carry."""
    seat = ", ".join(f"{1e3 * value:.1f}" for value in reply.seating.pose.position)
    out.print(f"[bold]{reply.limb}[/bold] of {reply.robot}")
    off = 1e3 * reply.seating.backed_off
    backed = f", backed off {off:.1f} mm" if off else ""
    out.print(f"hold seated by rule {reply.seating.rule}{backed}, its origin in H ({seat}) mm")
    if reply.wrist.error is not None:
        _print_floating(reply.wrist.palm or "off", reply.wrist.error, out)
    _print_closing(reply, out)
    for closing in reply.closing:
        if closing.nearby or closing.nearby_turn > NEARLY:
            out.print(_nearby_sentence(closing))
    title = "tendon tension at which the finger's first tile lets go"
    print_rows(reply.tension_limits, TENSION_LIMITS, out, title)
    if reply.capability is None:
        out.print("nothing is left at utilisation 1: closing alone is more than its tiles hold")
        return
    faces = None if reply.half_spaces is None else reply.half_spaces.offsets
    listed = ((reply.vertices, "vertices"), (faces, "half-spaces"))
    counts = [f"{len(each)} {name}" for each, name in listed if each is not None]
    counts += [] if reply.dimension is None else [f"dimension {reply.dimension}"]
    if counts:
        out.print(", ".join(counts))
    for warning in reply.warnings:
        out.print(warning, markup=False)
    _print_capability(reply.capability, out)


def print_robust(robust: replies.RobustCapability, out: Console) -> None:
    """Print what is left of each component where the hand is a little elsewhere."""
    title = (
        f"what is left of that at {robust.draws} places "
        f"within {1e3 * robust.position:g} mm and {1e3 * robust.angle:g} mrad"
    )
    _print_ends({"99 in 100 ": robust.hundredth, "9 in 10 ": robust.tenth}, title, out)
    if robust.without:
        out.print(f"at {robust.without} of them the hand cannot be, or holds nothing: 0 there")


def _print_ends(
    reaches: Mapping[str, Mapping[str, float | None]], title: str, out: Console
) -> None:
    """Print the least and the most of each component, from how far sets reach either way."""
    heads = [f"{what}{end}" for what in reaches for end in ("least", "most")]
    rows: list[list[Any]] = [[f"{axis} {unit_of(axis)}"] for axis in replies.AXES]
    for row, axis in zip(rows, replies.AXES, strict=True):
        for ways in reaches.values():
            back = ways[f"-{axis}"]
            row += [None if back is None else -back, ways[f"+{axis}"]]
    print_rows(rows, in_order(["axis"], heads, form="z.2f"), out, title)


def _print_floating(palm: str, error: float, out: Console) -> None:
    """Say what the set of a floating hand stands for, and what it does not."""
    out.print(
        f"floating wrist: this set is linearised at rest, for a palm that {CARRIES[palm]}. At its "
        f"farthest wrenches the exact model differs by up to {error:.1f} N (moments over 0.1 m). "
        "--search N finds what the hand really holds, palm and all.",
        markup=False,
    )


def _print_capability(capability: Mapping[str, replies.AxisCapability], out: Console) -> None:
    """Print the least and the most of each component, and those of it alone if there are any."""
    with_pure = any(end.pure is not None for end in capability.values())
    reaches: dict[str, Mapping[str, float | None]] = {
        "": {way: end.extent for way, end in capability.items()}
    }
    if with_pure:
        reaches["pure "] = {way: end.pure for way, end in capability.items()}
    _print_ends(reaches, "wrenches on the rock along the axes of H", out)
    out.print("least, most: with whatever else the hand can carry")
    if with_pure:
        out.print("pure: with every other component zero; -: none")
    ends = [capability[f"{sign}{replies.AXES[0]}"].pure for sign in "+-"]
    if any(end is None or round(end, 2) < 0.0 for end in ends):
        out.print("zero is not in this set: with nothing on the wrist a limit would be exceeded")


def _print_certificate(proof: replies.Certificate, needed: Sequence[float], out: Console) -> None:
    """Print what is missing, what could be held instead, and what is in the way."""
    if proof.shortfall is not None and proof.nearest is not None:
        where = "at any utilisation"
        if proof.utilisation is not None:
            where = f"up to a utilisation of {proof.utilisation:g}"
        rows = (
            ("needed", *needed),
            ("nearest held", *proof.nearest),
            ("missing", *proof.shortfall),
        )
        columns = in_order([""], replies.AXES, form="z.1f")
        print_rows(rows, columns, out, f"body wrenches {where}, in B [N, N·m]")
    if proof.irreducible:
        title = "these leave no balance, each needed for that; others may be in the way, too"
        alike = [(*names, ", ".join(of) or "-") for names, of in _alike(proof.irreducible).items()]
        print_rows(alike, in_order(("hand", "limit"), texts=["of"]), out, title)
        words = {each.limit: planner.constraint_words(each) for each in proof.irreducible}
        for limit, said in words.items():
            out.print(f"{limit}: {said}", markup=False)
        if proof.sufficient is not None:
            out.print()
            out.print(_sufficient_sentence(proof.sufficient), markup=False)


def _sufficient_sentence(names: Sequence[planner.LimitName]) -> str:
    """Say which limits, taken away alone, would do."""
    if not names:
        return "no single one of them, taken away alone, would do"
    which = "this one" if len(names) == 1 else "any one of these"
    told = ", ".join(
        f"{limb} {limit}" + (f" ({', '.join(owners)})" if owners else "")
        for (limb, limit), owners in _alike(names).items()
    )
    return f"{which}, taken away alone, would let it be held: {told}"


def _alike(names: Iterable[planner.LimitName]) -> dict[tuple[str, str], list[str]]:
    """Return limits by limb and kind, in their order, with what of the limb each is of."""
    alike: dict[tuple[str, str], list[str]] = {}
    for each in names:
        parts = (each.phalanx, each.finger, each.joint)
        whose = " of ".join(part for part in parts if part is not None)
        owners = alike.setdefault((each.limb, each.limit), [])
        owners += [whose] if whose else []
    return alike


def _print_closing(reply: replies.WrenchSpaceReply, out: Console) -> None:
    """Print what of each finger touches, and when it stopped moving."""
    kinds = {(contact.finger, contact.phalanx): contact.contact for contact in reply.contacts}

    rows = []
    for closing in reply.closing:
        base = kinds.get((closing.finger, "base"), "")
        cells = (
            f"{kinds.get((closing.finger, stage.part), '')} {stage.ends:.1f}"
            for stage in closing.stages
        )
        rows.append((closing.finger, base, *cells, closing.closure))
    parts = [stage.part for stage in reply.closing[0].stages]
    columns = in_order(("finger", "base"), parts, ["ends"])
    title = "contacts, and the tendon tension [N] at which each part was at rest"
    print_rows(rows, columns, out, title)


def _nearby_sentence(closing: replies.ClosingSequence) -> str:
    """Say how else a finger would end."""
    ends = f", or {', '.join(closing.nearby)}" if closing.nearby else ""
    return (
        f"{closing.finger} is {closing.closure} here; with the rock 0.1 mm elsewhere its joints "
        f"end up to {math.degrees(closing.nearby_turn):.1f}° from here{ends}"
    )


def _path_sentence(path: planner.TensionPath) -> str:
    """Say what the way from the present tensions is like."""
    used = path.utilisation_at_present
    there = "no balance" if used is None else f"utilisation {used:.3f}"
    way = "safe" if path.safe else "not safe"
    return f"from the present tensions ({there}): changes up to {path.largest_change:.1f} N, {way}"


def _load_factor(reply: replies.PlanReply) -> str:
    if reply.load_factor_unbounded:
        return "unbounded"
    if reply.load_factor is None:
        return "not found in time" if reply.load_factor_status == "not_finished" else "none"
    return f"{reply.load_factor:.3f}"


def _print_hands(hands: Sequence[replies.Hand], out: Console) -> None:
    """Print what each hand carries, where floating ones go, and what each finger does."""
    print_rows(hands, HANDS, out, "wrench on the rock, in H [N, N·m], and the palm's part")
    floating = [hand for hand in hands if hand.wrist.twist is not None]
    if floating:
        title = "where floating wrists go (mm, mrad), and how their palms carry"
        print_rows(floating, WRISTS, out, title)
    fingers = [(hand.limb, finger, _worst(finger)) for hand in hands for finger in hand.fingers]
    title = "tendons and their motors, and each finger's most loaded tile"
    print_rows(fingers, FINGERS, out, title, groups=True)


def _worst(finger: Any) -> Any:
    """Return a finger's most loaded tile; None where none touches."""
    touching = [tile for tile in finger.tiles if tile.contact != "none"]
    return max(touching, key=attrgetter("utilisation"), default=None)


def _print_joints(
    torques: Mapping[str, Sequence[float]], limits: Mapping[str, Sequence[float]], out: Console
) -> None:
    """Print each limb's torques, in lines of so many as fit, with how much of its joints is used.

    The joint that uses most of its limit is marked.
    """
    most = max((len(row) for row in torques.values()), default=0)
    width = min(most, JOINTS_A_LINE)
    rows: list[list[str]] = []
    for limb, row in torques.items():
        # a joint without a motor bears nothing of nothing
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
    # otherwise seven torques do not fit
    print_rows(rows, columns, out, title, padding=0)


def _print_clearance(clearance: planner.Clearance, out: Console) -> None:
    """Print the least distances, and what was not measured."""
    pairs = ("link_rock", "link_link", "hand_hand", "hand_body", "body_rock")
    near = {pair.replace("_", " "): getattr(clearance, pair) for pair in pairs}
    title = "least distances; below zero: how deep one is in the other"
    print_rows([row for row in near.items() if row[1] is not None], CLEARANCES, out, title)
    for missing in clearance.unchecked:
        out.print(f"not measured: {missing}", markup=False)
