"""Replies as tables for a person, in 80 columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from planner import (
    Clearance,
    LimitName,
    Price,
    RobustLoadFactor,
    Spread,
    TensionPath,
    constraint_words,
)
from service.replies import (
    AXES,
    AxisCapability,
    Certificate,
    ClosingSequence,
    Hand,
    PlanReply,
    RobustCapability,
    WrenchSpaceReply,
)
from service.tables.extras import print_clearance, robust_sentence, spread_sentence, within
from service.tables.layout import in_colour, short, show, table_of, unit_of

__all__ = ["print_plan", "print_robust", "print_wrench_space"]

MOST_PRICES: Final = 8
"""Prices shown; the dearest first."""

NEARLY: Final = 0.02
"""Turns of joints that are told where the rock is a little elsewhere; less is not much [rad]."""

JOINTS_A_LINE: Final = 7
"""Joint torques of a limb in one line of a table."""

UNBOUNDED: Final = 1000
"""Width in which any table fits [letters]."""

CARRIES: Final[Mapping[str, str]] = {
    "off": "carries nothing",
    "drags": "drags on the rock",
    "presses": "presses on the rock",
    "drags_and_presses": "drags and presses on the rock",
}
"""What a palm does in each of its modes."""


def print_plan(
    reply: PlanReply,
    out: Console,
    *,
    without_palm: PlanReply | None = None,
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
    spread = reply.spread if isinstance(reply.spread, Spread) else None
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
    if isinstance(reply.robust, RobustLoadFactor):
        out.print(robust_sentence(reply.robust), markup=False)
    if isinstance(reply.clearance, Clearance):
        print_clearance(reply.clearance, out)
    if reply.hands is not None:
        show(
            "wrench on the rock, in H [N, N·m], and the palm's part",
            _hand_table(reply.hands, out),
            out,
        )
        floating = [hand for hand in reply.hands if hand.wrist.twist is not None]
        if floating:
            title = "where floating wrists go (mm, mrad), and how their palms carry"
            show(title, _wrist_table(floating), out)
        title = "tendons and their motors, and each finger's most loaded tile"
        show(title, _tendon_table(reply.hands), out)
    if reply.joint_torque is not None and reply.joint_torque_limit is not None:
        title = "joint torques [N·m], from the body outward; * most of its limit"
        show(title, _joint_table(reply.joint_torque, reply.joint_torque_limit), out)
    for prices, what in ((reply.prices, "utilisation"), (reply.effort_prices, "effort")):
        if prices:
            title = f"what one unit more of a limit would take off the {what}"
            if len(prices) > MOST_PRICES:
                title += f" ({MOST_PRICES} of {len(prices)})"
            show(title, _price_table(prices[:MOST_PRICES]), out)
    if reply.certificate is not None:
        _print_certificate(reply.certificate, reply.body_wrench, out)


def _first_line(reply: PlanReply, spread: Spread | None) -> Iterator[str]:
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


def print_wrench_space(reply: WrenchSpaceReply, out: Console) -> None:
    """Print what one hand can carry."""
    seat = ", ".join(f"{1e3 * value:.1f}" for value in reply.seating.pose.position)
    out.print(f"[bold]{reply.limb}[/bold] of {reply.robot}")
    off = 1e3 * reply.seating.backed_off
    backed = f", backed off {off:.1f} mm" if off else ""
    out.print(f"hold seated by rule {reply.seating.rule}{backed}, its origin in H ({seat}) mm")
    if reply.wrist.error is not None:
        _print_floating(reply.wrist.palm or "off", reply.wrist.error, out)
    show(
        "contacts, and the tendon tension [N] at which each part was at rest",
        _closing_table(reply),
        out,
    )
    for closing in reply.closing:
        if closing.nearby or closing.nearby_turn > NEARLY:
            out.print(_nearby_sentence(closing))
    tensions = table_of("finger", "phalanx", numbers=["f_t(max) N"])
    for limit in reply.tension_limits:
        tension = "none" if limit.tension is None else f"{limit.tension:.1f}"
        tensions.add_row(limit.finger, limit.phalanx or "-", tension)
    show("tendon tension at which the finger's first tile lets go", tensions, out)
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


def print_robust(robust: RobustCapability, out: Console) -> None:
    """Print what is left of each component where the hand is a little elsewhere."""
    names = ("99 in 100 least", "99 in 100 most", "9 in 10 least", "9 in 10 most")
    table = table_of("axis", numbers=names)
    for axis in AXES:
        ends = [(way[f"-{axis}"], way[f"+{axis}"]) for way in (robust.hundredth, robust.tenth)]
        table.add_row(f"{axis} {unit_of(axis)}", *_ends_of(ends))
    title = (
        f"what is left of that at {robust.draws} places "
        f"within {1e3 * robust.position:g} mm and {1e3 * robust.angle:g} mrad"
    )
    show(title, table, out)
    if robust.without:
        out.print(f"at {robust.without} of them the hand cannot be, or holds nothing: 0 there")


def _print_floating(palm: str, error: float, out: Console) -> None:
    """Say what the set of a floating hand stands for, and what it does not."""
    out.print(
        f"floating wrist: this set is linearised at rest, for a palm that {CARRIES[palm]}. At its "
        f"farthest wrenches the exact model differs by up to {error:.1f} N (moments over 0.1 m). "
        "--search N finds what the hand really holds, palm and all.",
        markup=False,
    )


def _print_capability(capability: Mapping[str, AxisCapability], out: Console) -> None:
    """Print the least and the most of each component, and those of it alone if there are any."""
    with_pure = any(end.pure is not None for end in capability.values())
    pure = ("pure least", "pure most") if with_pure else ()
    reaches = table_of("axis", numbers=("least", "most", *pure))
    for axis in AXES:
        less, more = capability[f"-{axis}"], capability[f"+{axis}"]
        ways = [(less.extent, more.extent), (less.pure, more.pure)][: 1 + with_pure]
        reaches.add_row(f"{axis} {unit_of(axis)}", *_ends_of(ways))
    show("wrenches on the rock along the axes of H", reaches, out)
    out.print("least, most: with whatever else the hand can carry")
    if with_pure:
        out.print("pure: with every other component zero; -: none")
    ends = [capability[f"{sign}{AXES[0]}"].pure for sign in "+-"]
    if any(end is None or round(end, 2) < 0.0 for end in ends):
        out.print("zero is not in this set: with nothing on the wrist a limit would be exceeded")


def _print_certificate(proof: Certificate, needed: Sequence[float], out: Console) -> None:
    """Print what is missing, what could be held instead, and what is in the way."""
    if proof.shortfall is not None and proof.nearest is not None:
        where = "at any utilisation"
        if proof.utilisation is not None:
            where = f"up to a utilisation of {proof.utilisation:g}"
        table = table_of("", numbers=AXES)
        parts = {"needed": needed, "nearest held": proof.nearest, "missing": proof.shortfall}
        for name, wrench in parts.items():
            table.add_row(name, *(f"{value:z.1f}" for value in wrench))
        show(f"body wrenches {where}, in B [N, N·m]", table, out)
    if proof.irreducible:
        title = "these leave no balance, each needed for that; others may be in the way, too"
        show(title, _barrier_table(proof.irreducible), out)
        words = {name.limit: constraint_words(name) for name in proof.irreducible}
        for limit, said in words.items():
            out.print(f"{limit}: {said}", markup=False)
        if proof.sufficient is not None:
            out.print()
            out.print(_sufficient_sentence(proof.sufficient), markup=False)


def _sufficient_sentence(names: Sequence[LimitName]) -> str:
    """Say which limits, taken away alone, would do."""
    if not names:
        return "no single one of them, taken away alone, would do"
    which = "this one" if len(names) == 1 else "any one of these"
    told = ", ".join(
        f"{limb} {limit}" + (f" ({', '.join(owners)})" if owners else "")
        for (limb, limit), owners in _alike(names).items()
    )
    return f"{which}, taken away alone, would let it be held: {told}"


def _alike(names: Iterable[LimitName]) -> dict[tuple[str, str], list[str]]:
    """Return limits by limb and kind, in their order, with what of the limb each is of."""
    alike: dict[tuple[str, str], list[str]] = {}
    for name in names:
        parts = (name.phalanx, name.finger, name.joint)
        whose = " of ".join(part for part in parts if part is not None)
        owners = alike.setdefault((name.limb, name.limit), [])
        owners += [whose] if whose else []
    return alike


def _barrier_table(names: Iterable[LimitName]) -> Table:
    """Return limits by hand and kind, in their order."""
    table = table_of("hand", "limit", words=["of"])
    for (limb, limit), owners in _alike(names).items():
        table.add_row(limb, limit, ", ".join(owners) or "-")
    return table


def _closing_table(reply: WrenchSpaceReply) -> Table:
    """Return what of each finger touches, and when it stopped moving."""
    kinds = {(contact.finger, contact.phalanx): contact.contact for contact in reply.contacts}
    parts = [stage.part for stage in reply.closing[0].stages]
    table = table_of("finger", "base", numbers=parts, words=["ends"])
    for closing in reply.closing:
        cells = [
            f"{kinds.get((closing.finger, stage.part), '')} {stage.ends:.1f}"
            for stage in closing.stages
        ]
        base = kinds.get((closing.finger, "base"), "")
        table.add_row(closing.finger, base, *cells, closing.closure)
    return table


def _nearby_sentence(closing: ClosingSequence) -> str:
    """Say how else a finger would end."""
    ends = f", or {', '.join(closing.nearby)}" if closing.nearby else ""
    return (
        f"{closing.finger} is {closing.closure} here; with the rock 0.1 mm elsewhere its joints "
        f"end up to {math.degrees(closing.nearby_turn):.1f}° from here{ends}"
    )


def _path_sentence(path: TensionPath) -> str:
    """Say what the way from the present tensions is like."""
    used = path.utilisation_at_present
    there = "no balance" if used is None else f"utilisation {used:.3f}"
    way = "safe" if path.safe else "not safe"
    return f"from the present tensions ({there}): changes up to {path.largest_change:.1f} N, {way}"


def _load_factor(reply: PlanReply) -> str:
    if reply.load_factor_unbounded:
        return "unbounded"
    if reply.load_factor is None:
        return "not found in time" if reply.load_factor_status == "not_finished" else "none"
    return f"{reply.load_factor:.3f}"


def _ends_of(ways: Iterable[tuple[float | None, float | None]]) -> Iterator[str]:
    """Yield the least and the most that follow from how far sets reach backward and forward."""
    for pair in ways:
        for sign, end in zip((-1.0, 1.0), pair, strict=True):
            yield "-" if end is None else f"{sign * end:z.2f}"


def _hand_table(hands: Iterable[Hand], out: Console) -> Table:
    parts = ("hand\nutil", "palm\nshear", "palm\npress")
    table = table_of("hand", numbers=(*AXES, *parts))
    for hand in hands:
        shear, _, press = hand.palm.force
        cells = [short(value, 0) for value in hand.wrench[:3]]
        cells += [short(value, 1) for value in hand.wrench[3:]]
        cells += [short(hand.utilisation, 2), short(-shear, 0), short(press, 0)]
        table.add_row(hand.limb, *cells)
    if out.measure(table, options=out.options.update(max_width=UNBOUNDED)).maximum > out.width:
        table.padding = (0, 1, 0, 0)
    return table


def _wrist_table(hands: Iterable[Hand]) -> Table:
    table = table_of("hand", numbers=("vx", "vy", "vz", "wx", "wy", "wz"))
    table.add_column("palm")
    for hand in hands:
        cells = [f"{1e3 * value:z.2f}" for value in hand.wrist.twist or ()]
        table.add_row(hand.limb, *cells, (hand.wrist.palm or "-").replace("_", " "))
    return table


def _tendon_table(hands: Iterable[Hand]) -> Table:
    table = table_of("hand", "finger", numbers=("tension N", "current A"))
    table.add_column("tile")
    table.add_column("util", justify="right")
    for hand in hands:
        for finger in hand.fingers:
            touching = [tile for tile in finger.tiles if tile.contact != "none"]
            worst = max(touching, key=lambda tile: tile.utilisation, default=None)
            cells = ("-", "-") if worst is None else (worst.phalanx, f"{worst.utilisation:.2f}")
            drive = (f"{finger.tendon_tension:.1f}", f"{finger.motor_current:.3f}")
            table.add_row(hand.limb, finger.name, *drive, *cells)
        table.add_section()
    return table


def _joint_table(
    torques: Mapping[str, Sequence[float]], limits: Mapping[str, Sequence[float]]
) -> Table:
    """Return each limb's torques, in lines of so many as fit, with how much of its joints is used.

    The joint that uses most of its limit is marked.
    """
    most = max((len(row) for row in torques.values()), default=0)
    columns = min(most, JOINTS_A_LINE)
    more = "+" if most > columns else ""
    table = table_of("limb", numbers=(*(f"{more}{i + 1}" for i in range(columns)), "of", "util"))
    table.padding = 0  # otherwise seven torques do not fit
    for limb, row in torques.items():
        # a joint without a motor bears nothing of nothing
        pairs = zip(row, limits[limb], strict=True)
        used = [abs(torque) / (limit or math.inf) for torque, limit in pairs]
        worst = used.index(max(used))
        cells = [
            f"{torque:z.{0 if abs(torque) >= 1e3 else 1}f}" + ("*" if i == worst else " ")
            for i, torque in enumerate(row)
        ]
        ends = (f"{limits[limb][worst]:.4g}", f"{used[worst]:.2f}")
        for start in range(0, len(cells), columns):
            line = cells[start : start + columns]
            line += [""] * (columns - len(line))
            named, last = (limb, ends) if start == 0 else (f"  from {start + 1}", ("", ""))
            table.add_row(named, *line, *last)
    return table


def _price_table(prices: Iterable[Price]) -> Table:
    table = table_of("hand", "finger, joint", "tile", "limit", numbers=["price"])
    for price in prices:
        part = price.finger or price.joint or "-"
        names = (price.limb, part, price.phalanx or "-", price.limit)
        table.add_row(*names, f"{price.price:.2g} /{price.unit}")
    return table
