"""Panels beside the views of a plan: utilisations, or the missing wrench, and the spread."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgba

from hand_models.base import COLOUR_OF, Array
from hand_models.hand import NAIL
from planner.explanation import constraint_words, part_words
from planner.pictures.plan_views import UTILISATION_COLOURS, UTILISATION_NORM, colour_of, ink_on
from planner.pictures.settings import CENTRED_TEXT
from planner.question import Question
from planner.result import SPREAD_SETTINGS, Certificate, LimitName, Plan, Spread

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "draw_answers",
    "draw_bar",
    "draw_joints",
    "draw_shortfall",
    "draw_spread",
    "draw_tiles",
]


def draw_bar(figure: Figure, label: str, **place: Any) -> None:
    """Draw the bar that says what the colours of utilisations mean.

    Parameters
    ----------
    figure : Figure
    label : str
        Label of the bar.
    **place
        Of matplotlib's ``Figure.colorbar``: the axes beside which the bar is, or its own.
    """
    shades = ScalarMappable(UTILISATION_NORM, UTILISATION_COLOURS)
    figure.colorbar(shades, label=label, extend="max", **place)


def draw_tiles(axes: Any, plan: Plan, question: Question) -> None:
    """Draw a table of utilisations as colours: tiles, tendons with their motors, palms and hands.

    A tendon's cell has the largest utilisation of tension, motor torque and motor current. The
    cells of a palm, and of a hand (its most used limit), span the rows of that hand's fingers.

    Parameters
    ----------
    axes : Axes
        Matplotlib axes to draw into.
    plan : Plan
        A plan that has loads.
    question : Question
        Question that the plan answers.
    """
    hands = plan.hands or ()
    body, cap = question.stance.robot.hand, question.limits.tendon_tension
    strength = body.maximum_tension if cap is None else min(cap, body.maximum_tension)
    clings = any(f.tiles[-1].phalanx == NAIL for hand in hands for f in hand.fingers)
    columns = ("base", "proximal", "middle", "distal", *((NAIL,) if clings else ()))
    names: list[str] = []
    rows: list[list[float]] = []
    whole: list[tuple[float, float]] = []
    for hand in hands:
        for finger in hand.fingers:
            touching = (tile for tile in finger.tiles if tile.contact != "none")
            used = {tile.phalanx: tile.utilisation for tile in touching}
            tension = finger.tendon_tension
            torque = finger.motor_torque / body.drive.maximum_torque
            tendon = max(
                tension / strength, torque, finger.motor_current / body.drive.maximum_current
            )
            rows.append([*(used.get(phalanx, np.nan) for phalanx in columns), tendon])
            names.append(f"{hand.limb}  {finger.name}  {tension:3.0f} N".replace("_", " "))
        palm = hand.palm.utilisation if hand.palm.engaged else np.nan
        whole += [(palm, hand.utilisation)] * len(hand.fingers)
    values = np.column_stack([rows, whole])
    _draw_colours(axes, values, [*columns, "tendon", "palm", "hand"], names)
    _write_numbers(axes, values[:, :-2])
    for part in range(len(columns), values.shape[1]):
        axes.axvline(part - 0.5, color="white", linewidth=3.0)
    done = 0
    for hand in hands:
        middle = done + 0.5 * (len(hand.fingers) - 1)
        _write_numbers(axes, values[done : done + 1, -2:], (middle, len(columns) + 1))
        done += len(hand.fingers)
        if hand is not hands[-1]:
            axes.axhline(done - 0.5, color="black", linewidth=1.0)
    axes.set_title("utilisation of each tile, tendon, palm and hand", fontsize=10, loc="right")


def draw_joints(axes: Any, used: Mapping[str, Array]) -> None:
    """Draw a table of the joints' utilisations as colours.

    Parameters
    ----------
    axes : Axes
        Matplotlib axes to draw into.
    used : mapping of str to ndarray, shape (n,)
        Utilisation of the n joints of each limb, from the body outward.
    """
    values = np.array(list(zip_longest(*used.values(), fillvalue=np.nan))).T
    columns = [str(i + 1) for i in range(values.shape[1])]
    _draw_colours(axes, values, columns, [limb.replace("_", " ") for limb in used])
    _write_numbers(axes, values)
    axes.set_title("utilisation of each joint, from the body outward", fontsize=10, loc="right")


def _draw_colours(axes: Any, values: Array, columns: Iterable[str], rows: Iterable[str]) -> None:
    """Draw numbers as colours; none where a number is NaN."""
    style: dict[str, Any] = {"cmap": UTILISATION_COLOURS, "norm": UTILISATION_NORM}
    shown = np.ma.masked_invalid(values)
    axes.imshow(shown, aspect="auto", interpolation="none", **style)
    axes.set_xticks(range(values.shape[1]), list(columns), fontsize=8)
    axes.set_yticks(range(values.shape[0]), list(rows), fontsize=8)
    axes.tick_params(length=0)
    titles = axes.get_xticklabels()
    widest = max(title.get_window_extent().width for title in titles)
    if widest > axes.bbox.width / values.shape[1]:
        for title in titles:
            title.set(rotation=30.0, ha="right", rotation_mode="anchor")


def _write_numbers(axes: Any, values: Array, first: tuple[float, float] = (0.0, 0.0)) -> None:
    """Write numbers that are not NaN on their colours, the first at a row and a column."""
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = ink_on(colour_of(value))
            # as many digits as fit, of what is rounded up, too
            text = f"{value:.{2 if value < 9.995 else 1 if value < 99.95 else 0}f}"
            text = text if value < 999.0 else "999+"
            axes.text(first[1] + j, first[0] + i, text, color=colour, **CENTRED_TEXT)


def draw_shortfall(axes: Any, plan: Plan) -> None:
    """Write the missing body wrench of an infeasible plan, and which constraints block it.

    The constraints are the first of the certificate's irreducible infeasible subset or, where that
    is undecided, of its blocking rows.

    Parameters
    ----------
    axes : Axes
        Matplotlib axes to draw into.
    plan : Plan
        An infeasible plan, without loads.
    """
    axes.set_axis_off()
    proof = plan.certificate
    if proof is None:
        axes.text(0.5, 0.5, "no plan, no loads", ha="center", va="center")
        return
    style: dict[str, Any] = {"fontsize": 8, "ha": "left", "va": "top"}
    # of the table of wrenches, and above and below it, over the panel's height
    height, gap, top = 0.26, 0.025, 1.0
    if proof.shortfall is not None and proof.nearest is not None:
        axes.text(0.0, 1.0, "body wrench in B, and the nearest that can be had", **style)
        wrenches = np.column_stack([plan.body_wrench, proof.nearest, proof.shortfall])
        _write_wrenches(axes, wrenches, (0.0, 1.0 - gap - height, 0.9, height))
        top -= height + 2.0 * gap
    axes.text(0.0, top, "\n".join(_barriers(proof)), linespacing=1.5, **style)


def _write_wrenches(axes: Any, values: Array, place: tuple[float, float, float, float]) -> None:
    """Write wrenches, shape (6, 3), as a table at a place, whose lines part the rows."""
    names = ("fx [N]", "fy [N]", "fz [N]", "mx [N·m]", "my [N·m]", "mz [N·m]")
    rows = [
        [name, *(f"{round(value, 1) + 0.0:.1f}" for value in row)]
        for name, row in zip(names, values, strict=True)
    ]
    heads = ("", "needed", "nearest", "missing")
    table = axes.table(rows, colLabels=heads, edges="horizontal", bbox=place)
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    for cell in table.get_celld().values():
        cell.set(edgecolor="0.7")
        cell.set_text_props(ha="right")


def _barriers(proof: Certificate) -> list[str]:
    """Return lines that say what is in the way of a balance."""
    if proof.irreducible == ():
        return ["the hands have no loads at all, of any sign, that give it"]
    if proof.irreducible is None:
        return ["in the way, the weightiest first:", *_lines(proof.blocking)]
    head = "these leave no balance, each needed for that; others may be, too:"
    return [head, *_lines(proof.irreducible)]


def _lines(names: Sequence[LimitName]) -> list[str]:
    """Return what constraints forbid, by hand, a hand's alike in one line; the first lines."""
    alike: dict[str, dict[str, list[str]]] = {}
    for name in names:
        of_limb = alike.setdefault(name.limb, {})
        of_limb.setdefault(constraint_words(name), []).append(part_words(name))
    lines = []
    for limb, found in alike.items():
        lines.append(f"{limb.replace('_', ' ')}:")
        for words, owners in found.items():
            of = ", ".join(filter(None, owners))
            text = f"{words} ({of})" if of else words
            lines += textwrap.wrap(text, 64, initial_indent="    ", subsequent_indent="        ")
    most = 24  # lines that say what leaves no balance
    if len(lines) > most:
        lines[most:] = ["…"]
    return lines


def draw_answers(axes: Any, spread: Spread) -> None:
    """Draw in how many samples a stance is feasible, planned anew or with the plan's set-points.

    Parameters
    ----------
    axes : Axes
    spread : Spread
        Each of its answers is a bar: feasible, overloaded (or dragged) and without balance.
    """
    there = {textwrap.fill(words, 12): each for words, each in spread.answers.items()}
    holds, without = np.array([(each.holds, each.without) for each in there.values()]).T
    parts = {
        "feasible": (holds, COLOUR_OF["green"]),
        spread.failing: (spread.draws - holds - without, COLOUR_OF["amber"]),
        "no balance": (without, "0.3"),
    }
    left = np.zeros(len(there))
    for words, (counts, colour) in parts.items():
        axes.barh(list(there), counts, left=left, color=colour, label=words, height=0.55)
        left = left + counts
    axes.set(xlim=(0.0, spread.draws), xlabel="samples", ylim=(len(there) - 0.55, -0.75))
    axes.tick_params(labelsize=8)
    for label in axes.get_yticklabels():
        label.set(linespacing=1.0)
    colours = [colour for _, colour in parts.values()]
    for row in range(len(there)):
        _write_counts(axes, row, [int(counts[row]) for counts, _ in parts.values()], colours)
    _legend_above(axes, "right")


def _write_counts(axes: Any, row: int, counts: Sequence[int], colours: Sequence[str]) -> None:
    """Write the counts of a bar's parts in them; side by side above the bar where too narrow."""
    gap, edge, begin = 3.0, 0.0, 0.0  # gap between texts, and each text's right edge [px]
    per_sample = axes.bbox.width / axes.get_xlim()[1]
    for count, colour in zip(counts, colours, strict=True):
        middle, begin = begin + 0.5 * count, begin + count
        if not count:
            continue
        ink = ink_on(to_rgba(colour))
        text = axes.text(middle, row, str(count), color=ink, **CENTRED_TEXT)
        width = text.get_window_extent().width
        if width + gap > per_sample * count:
            middle = max(middle, (edge + gap + 0.5 * width) / per_sample)
            edge = per_sample * middle + 0.5 * width
            text.set(x=middle, y=row - 0.29, color="black", va="bottom")


def _legend_above(axes: Any, side: Literal["left", "right"]) -> None:
    """Write the legend in two lines above a small panel, from its left or right edge."""
    at = 0.0 if side == "left" else 1.03
    place: dict[str, Any] = {"loc": f"lower {side}", "bbox_to_anchor": (at, 0.96), "ncols": 2}
    spaces: dict[str, Any] = {"columnspacing": 0.8, "labelspacing": 0.2, "borderpad": 0.2}
    axes.legend(fontsize=8, frameon=False, handlelength=1.0, **spaces, **place)


def draw_spread(axes: Any, spread: Spread, nominal: float | None) -> None:
    """Draw a histogram of the load factors over the parameter samples.

    Parameters
    ----------
    axes : Axes
        Matplotlib axes to draw into.
    spread : Spread
        Spread that has load factors.
    nominal : float or None
        Load factor of the plan with nominal parameters.
    """
    factors = [factor for factor in spread.load_factors if factor is not None]
    if spread.load_factor is None:
        return
    low, high = spread.load_factor.low, spread.load_factor.high
    ends = np.array([*factors, 1.0, 1.0 if nominal is None else nominal])
    many = len(factors) >= SPREAD_SETTINGS.many_draws
    axes.axvspan(low, high, color="0.88", label="5 to 95 %" if many else "all")
    axes.hist(factors, np.linspace(ends.min(), ends.max(), 15 + 1), color=COLOUR_OF["blue"])
    axes.axvline(1.0, color=COLOUR_OF["red"], linestyle="--", label="needed")
    if nominal is not None:
        axes.axvline(nominal, color="black", label="nominal")
    said, limit = f"feasible in {spread.holds} of {spread.draws} samples", spread.threshold
    if limit is not None and limit.shear_limit is not None:
        said = f"feasible where a tile on {limit.surface} holds {limit.shear_limit:.2g} N or more"
        said += f": {limit.share:.0%} of its range"
    said = textwrap.fill(said, 56)
    if spread.cap < 1.0:
        said += f"\n(utilisation up to {spread.cap:g})"
    axes.set_title(said, fontsize=9, loc="left", pad=30.0)
    axes.set(xlabel="load factor [1]", ylabel="samples")
    axes.margins(x=0.04)
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.tick_params(labelsize=8)
    _legend_above(axes, "left")
