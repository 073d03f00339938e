"""Print the wrenches that one hand can exert: by its wrench space, near its pose, or by search."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, NAIL
from hand_models.wrench_spaces import Row
from planner import Survey
from service import replies
from service.replies import WRENCH_AXES
from service.tables.layout import axis_unit, in_order, name, number, print_rows, text

__all__ = ["print_failures", "print_robust", "print_survey", "print_wrench_space", "survey_json"]


def print_wrench_space(reply: replies.WrenchSpaceReply, out: Console) -> None:
    """Print the wrench space of one hand: contacts, closures, and capability by axis.

    Parameters
    ----------
    reply : WrenchSpaceReply
        Wrenches that the hand can exert on the rock, in H [N, N·m].
    out : Console
        Console to print on.
    """
    seat = ", ".join(f"{1e3 * value:.1f}" for value in reply.seating.pose.position)
    out.print(Text.assemble((reply.limb, "bold"), f" of {reply.robot}"))
    off = 1e3 * reply.seating.backed_off
    backed = f", backed off {off:.1f} mm" if off else ""
    out.print(f"hold seated by rule {reply.seating.rule}{backed}, its origin in H ({seat}) mm")
    if reply.wrist.error is not None:
        _print_floating(reply.wrist.palm or "off", reply.wrist.error, out)
    _print_closing(reply, out)
    for closing in reply.closing:
        # [rad] for rock a little elsewhere
        if closing.nearby or closing.nearby_turn > 0.02:
            out.print(_nearby_sentence(closing))
    title = "tendon tension at which the finger's first tile lets go"
    columns = (
        name("finger"),
        name("phalanx"),
        number("f_t(max) N", lambda end: "none" if end.tension is None else f"{end.tension:.1f}"),
    )
    print_rows(reply.tension_limits, columns, out, title)
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
        out.print(warning)
    _print_capability(reply.capability, out)
    for sentence in (reply.cannot or {}).values():
        out.print(sentence)


def print_robust(robust: replies.RobustCapability, out: Console) -> None:
    """Print the capability of a hand over sampled places near the given one, by axis.

    Parameters
    ----------
    robust : RobustCapability
        Quantiles of the reach along each axis of H [N, N·m].
    out : Console
        Console to print on.
    """
    title = (
        f"what is left of that at {robust.draws} places "
        f"within {1e3 * robust.position:g} mm and {1e3 * robust.angle:g} mrad"
    )
    legend = ["each column is a quantile by itself: a row's least may be above its most"]
    _print_ends({"99 in 100 ": robust.hundredth, "9 in 10 ": robust.tenth}, title, out, legend)
    if robust.without:
        out.print(f"at {robust.without} of them the hand cannot be, or holds nothing: 0 there")
    if robust.pure_tenth and robust.share:
        rows = [
            (f"{way} N", value, f"{100.0 * robust.share[way]:.0f}")
            for way, value in robust.pure_tenth.items()
        ]
        columns = (
            name("force", "0"),
            number("9 in 10", "1", "z.2f"),
            number("of the places %", "2"),
        )
        title = f"pure forces there, and where they are at least {robust.force:g} N"
        print_rows(rows, columns, out, title)


def _print_ends(
    reaches: Mapping[str, Mapping[str, float | None]],
    title: str,
    out: Console,
    legend: Sequence[str] = (),
) -> None:
    """Print the least and the most of each component, from the reach both ways along its axis."""
    heads = [f"{what}{end}" for what in reaches for end in ("least", "most")]
    rows: list[list[Any]] = [[f"{axis} {axis_unit(axis)}"] for axis in WRENCH_AXES]
    for row, axis in zip(rows, WRENCH_AXES, strict=True):
        for ways in reaches.values():
            back = ways[f"-{axis}"]
            row += [None if back is None else -back, ways[f"+{axis}"]]
    print_rows(rows, in_order(["axis"], heads, form="z.2f"), out, title, legend=legend)


def _print_floating(palm: str, error: float, out: Console) -> None:
    """Print what the wrench space of a floating hand covers, and what it does not."""
    carries = {
        "off": "carries nothing",
        "drags": "drags on the rock",
        "presses": "presses on the rock",
        "drags_and_presses": "drags and presses on the rock",
    }[palm]
    out.print(
        f"floating wrist: this set is linearised at rest, for a palm that {carries}. At its "
        f"farthest wrenches the exact model differs by up to {error:.1f} N (moments over 0.1 m). "
        "--search N finds what the hand really holds, palm and all.",
    )


def _print_capability(capability: Mapping[str, replies.AxisCapability], out: Console) -> None:
    """Print the least and the most of each component, and of each alone if there are any."""
    with_pure = any(end.pure is not None for end in capability.values())
    reaches: dict[str, Mapping[str, float | None]] = {
        "": {way: end.extent for way, end in capability.items()}
    }
    if with_pure:
        reaches["pure "] = {way: end.pure for way, end in capability.items()}
    legend = ["least, most: with whatever else the hand can carry"]
    if with_pure:
        legend.append("pure: with every other component zero; -: none")
    _print_ends(reaches, "wrenches on the rock along the axes of H", out, legend)
    ends = [capability[f"{sign}{WRENCH_AXES[0]}"].pure for sign in "+-"]
    if any(end is None or round(end, 2) < 0.0 for end in ends):
        out.print("zero is not in this set: with nothing on the wrist a limit would be exceeded")


def _print_closing(reply: replies.WrenchSpaceReply, out: Console) -> None:
    """Print which tiles of each finger touch, and when the finger stopped moving."""
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


def _nearby_sentence(closing: replies.ClosingSequenceReply) -> str:
    """Return in a sentence which closures a finger has on rock a little elsewhere."""
    ends = f", or {', '.join(closing.nearby)}" if closing.nearby else ""
    return (
        f"{closing.finger} is {closing.closure} here; with the rock 0.1 mm elsewhere its joints "
        f"end up to {math.degrees(closing.nearby_turn):.1f}° from here{ends}"
    )


def survey_json(survey: Survey) -> dict[str, Any]:
    """Convert the search over poses of a floating wrist into JSON values.

    Parameters
    ----------
    survey : Survey
        Result of the search.

    Returns
    -------
    dict
        Number of poses ``tried`` and ``held`` (no limit exceeded); extreme ``wrenches`` in H
        [N, N·m], their ``twists`` of the wrist [m, rad] and ``limiting`` limits; and ``ends``, the
        farthest wrench along each axis and sign, such as ``+fx``.
    """
    found = survey.found
    return {
        "tried": found.tried,
        "held": found.held,
        "wrenches": found.wrenches.tolist(),
        "twists": found.poses.tolist(),
        "limiting": [_limit(row) for row in found.limiting],
        "ends": {
            name: None
            if end is None
            else {
                "reach": end.reach,
                "wrench": end.wrench.tolist(),
                "twist": end.twist.tolist(),
                "limiting": _limit(end.limiting),
            }
            for name, end in zip(_names(), survey.ends, strict=True)
        },
    }


def _names() -> list[str]:
    return [f"{sign}{axis}" for axis in WRENCH_AXES for sign in "+-"]


def _limit(row: Row | None) -> dict[str, str | None] | None:
    if row is None:
        return None
    return {"finger": row.finger, "phalanx": row.phalanx, "limit": row.limit}


def print_survey(survey: Survey, out: Console) -> None:
    """Print the search over poses of a floating wrist: reach by axis, and limits exceeded first.

    Parameters
    ----------
    survey : Survey
        Result of the search.
    out : Console
        Console to print on.
    """
    found = survey.found
    out.print(
        f"search: at {found.held} of {found.tried} poses of the wrist nothing lets go; "
        f"{len(found.poses)} extreme wrenches",
    )
    _print_survey_ends(survey, out)
    if found.limiting:
        print_failures(found.limiting, out)


def _print_survey_ends(survey: Survey, out: Console) -> None:
    """Print where the hand lets go along each axis."""
    columns = (
        name("axis", lambda row: f"{row[0]} {axis_unit(row[0][1:])}"),
        number("reach", "1.reach", ".2f"),
        *(text(part, f"1.limiting.{part}") for part in ("finger", "phalanx", "limit")),
    )
    legend = []
    if any(end is None for end in survey.ends):
        legend.append("reach -: no way along the axis was found that holds")
    if any(end is not None and end.limiting is None for end in survey.ends):
        legend.append(
            "limit -: no limit binds there; the way ends at a tile dragged backwards, or where the "
            "search stopped",
        )
    print_rows(zip(_names(), survey.ends, strict=True), columns, out, legend=legend)


def print_failures(limiting: Sequence[Row | None], out: Console) -> None:
    """Print how often each tile of each finger, or another part, is the first to exceed its limit.

    Parameters
    ----------
    limiting : sequence of Row or None
        Limit that is reached first at each wrench; None for a hard row (nearly always: a tile
        would be dragged backwards).
    out : Console
        Console to print on.
    """
    # without a limit, a part that can only push or only pull would have to do the other: nearly
    # always a tile
    dragged = (None, "a tile dragged backwards")
    counts = Counter(dragged if row is None else _place(row) for row in limiting)
    order = ("finger", "base", *PHALANGES, NAIL)
    parts = [part for part in order if any(finger and what == part for finger, what in counts)]
    rows = []
    for finger in FINGERS:
        own = [counts[finger, part] for part in parts]
        rows.append((finger, *(count or "-" for count in own), sum(own)))
    for (other, what), count in counts.items():
        if other is None:
            rows.append((what, *[""] * len(parts), count))
    columns = in_order([""], [*parts, "all"])
    title = f"what lets go first, at how many of {len(limiting)}"
    print_rows(rows, columns, out, title)


def _place(row: Row) -> tuple[str | None, str]:
    """Return finger and part of a limit; if it is of no finger, the limit in words."""
    if row.finger is None:
        return None, row.limit.replace("_", " ")
    # of a finger as a whole, not of one of its tiles
    return row.finger, row.phalanx or "finger"
