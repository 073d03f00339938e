"""Print the extras of a plan: advice, spread over samples with sensitivities, robustness."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import islice
from types import MappingProxyType

from rich.console import Console

import planner
from service.replies import PlanReply
from service.tables.layout import counted, in_order, joined, name, number, print_rows

__all__ = [
    "load_factor_words",
    "palm_sentences",
    "print_advice",
    "print_open_loop",
    "print_route_survival",
    "print_spread",
    "print_survival",
    "robust_sentence",
    "spread_sentences",
    "sure_sentences",
    "with_interval",
    "words_of",
]


def words_of(advice: planner.Advice, *, holding: bool = False) -> str:
    """Return an advice as a sentence, with the utilisation that the change would give.

    Parameters
    ----------
    advice : Advice
        One change of the question, planned and verified.
    holding : bool, optional
        True if the stance is feasible without the change.
    """
    what = "better" if holding else "feasible" if advice.holds else "less overloaded"
    colon = "" if advice.sentence.startswith("if ") else ":"
    return f"{what} (utilisation {advice.utilisation:.2f}){colon} {advice.sentence}"


def print_advice(reply: PlanReply, out: Console) -> None:
    """Print the three best changes that a plan's advice has, or that no change helps.

    Parameters
    ----------
    reply : PlanReply
        Reply with advice; nothing is printed if it has none.
    out : Console
        Console to print on.
    """
    holding = reply.status == "optimal"
    # the three best changes
    for advice in islice(reply.advice or (), 3):
        out.print(words_of(advice, holding=holding))
    doubtful = any(each.kind == "unit" for each in reply.findings)
    if reply.advice == [] and "advice" not in reply.unfinished and not doubtful:
        out.print("no change that was tried lowers the utilisation")


def with_interval(value: float, spread: planner.Quantiles | None) -> str:
    """Return a number as text, with its interval from the 5 % to the 95 % quantile.

    The interval is rounded to the first decimal in which its ends differ, and the number to one
    decimal more.

    Parameters
    ----------
    value : float
        The number.
    spread : Quantiles or None
        Quantiles of the number over samples of the parameters; None to print the number alone.
    """
    if spread is None:
        return f"{value:.3f}"
    more = min(_digits(spread) + 1, 3)
    return f"{value:.{more}f} ({_interval(spread)})"


def print_spread(spread: planner.Spread, out: Console) -> None:
    """Print what a Monte Carlo study of uncertain parameters found, and how set-points fare in it.

    Parameters
    ----------
    spread : Spread
        Plans of all samples, and what the question's plan does in them.
    out : Console
        Console to print on.
    """
    for sentence in spread_sentences(spread):
        out.print(sentence)
    there = spread.answers.items()
    # a column has as many decimals as its narrowest interval with two ends needs
    found = [each.utilisation for _, each in there if each.utilisation is not None]
    digits = max((_digits(each) for each in found if each.high > each.low + 1e-3), default=3)
    rows = [
        (
            words,
            each.holds,
            spread.draws - each.holds - each.without,
            each.without,
            "none" if each.utilisation is None else _interval(each.utilisation, digits),
        )
        for words, each in there
    ]
    if len(rows) > 1:
        heads = ("feasible", spread.failing, "no balance", "utilisation")
        print_rows(rows, in_order([counted(spread.draws, "sample")], heads), out, result=True)


def spread_sentences(spread: planner.Spread) -> list[str]:
    """Return where a stance is feasible, and what the load factor's variance goes with."""
    return [each for each in (_spread_sentence(spread), _variance_sentence(spread)) if each]


def _spread_sentence(spread: planner.Spread) -> str:
    """Return in a sentence on which rock a stance is feasible, else in how many samples."""
    limit, samples = spread.threshold, counted(spread.draws, "sample")
    said = f"feasible in {spread.holds} of {samples}"
    within = f" within a utilisation of {spread.cap:g}" if spread.cap < 1.0 else ""
    if limit is not None:
        least, most = (f"{ratio:g}" for ratio in limit.range)
        rocks = f"the assumed range of {limit.surface}s ({least} to {most} times sandpaper)"
        said = f"feasible{within} on none of {rocks}"
        if limit.shear_limit is not None and limit.ratio is not None:
            said = (
                f"feasible{within} where a tile on this {limit.surface} holds at least "
                f"{limit.shear_limit:.2g} N, {limit.ratio:.2g} times sandpaper: "
                f"{limit.share:.0%} of the assumed range"
            )
            if limit.share == 1.0:
                said = f"feasible{within} on all of {rocks}"
    else:
        said += within
    if spread.without:
        said += f"; {counted(spread.without, 'sample')} without a plan"
    lost = spread.load_factors.count(None)
    if lost > spread.without:
        said += f"; {lost} without a load factor"
    return said + _refused(spread.refused)


def _variance_sentence(spread: planner.Spread) -> str:
    """Return in a sentence what the load factor's variance goes with: rock, then other numbers."""
    parts = []
    if spread.rock_share:
        parts.append(f"{spread.rock_share:.0%} by the rock's strength")
    # thirty samples tell a share to about a tenth
    others = [
        f"{round(each.share, 1):.0%} by {each.quantity} "
        f"({'fitted' if each.source == 'calibrated' else 'prior'})"
        for each in spread.rock_apart
    ]
    if others:
        parts.append(("of the rest " if parts else "") + ", ".join(others))
    return f"variance of the load factor: {'; '.join(parts)}" if parts else ""


def robust_sentence(robust: planner.RobustLoadFactor) -> str:
    """Return a sentence about the load factor over sampled places of the hands.

    Parameters
    ----------
    robust : RobustLoadFactor
        Load factor over places near the given ones.

    Returns
    -------
    str
        Quantiles of the load factor, and hands that cannot be at some of the places.
    """
    low, high = robust.tenth_interval
    said = f"10 % quantile {robust.tenth:.3f} ({low:.3f} to {high:.3f}), "
    said += f"1 % quantile {robust.hundredth:.3f}"
    said += f"; {robust.without} with a load factor of 0" if robust.without else ""
    said += _refused(robust.refused, robust.reasons)
    left = ""
    if robust.contact_position is not None and robust.contact_angle is not None:
        left = (
            f" (of hands placed by contact {1e3 * robust.contact_position:g} mm and "
            f"{1e3 * robust.contact_angle:g} mrad along z and about x and y)"
        )
    return (
        f"load factor, planned anew with each hand up to {1e3 * robust.position:g} mm and "
        f"{1e3 * robust.angle:g} mrad off its place{left}, {robust.draws} samples:\n{said}"
    )


def sure_sentences(
    reply: PlanReply | planner.Plan,
    without_palm: planner.Plan | None = None,
    palm_parts: planner.PalmLoadFactors | None = None,
) -> list[str]:
    """Return what says how sure a plan is: spread, load factors without palms, displaced hands."""
    said = spread_sentences(reply.spread) if isinstance(reply.spread, planner.Spread) else []
    said += palm_sentences(without_palm, palm_parts)
    if isinstance(reply.robust, planner.RobustLoadFactor):
        said.append(robust_sentence(reply.robust))
    return said


def palm_sentences(
    without_palm: planner.Plan | None, palm_parts: planner.PalmLoadFactors | None
) -> list[str]:
    """Return the load factors of plans without the palms, and without a part of their load."""
    if without_palm is None:
        return []
    said = [f"load factor without the palms' shear and pressing: {load_factor_words(without_palm)}"]
    if palm_parts is not None:
        shear, pressing = ("none" if each is None else f"{each:.3f}" for each in palm_parts)
        said += [f"without their shear alone: {shear}; without their pressing alone: {pressing}"]
    return said


def load_factor_words(reply: PlanReply | planner.Plan) -> str:
    """Return the load factor of a plan, or why there is none."""
    if reply.load_factor_unbounded:
        return "unbounded"
    if reply.load_factor is None:
        return "not found in time" if reply.load_factor_status == "not_finished" else "none"
    return f"{reply.load_factor:.3f}"


def print_open_loop(found: planner.OpenLoop, out: Console) -> None:
    """Print how a plan fares that is executed as it is on displaced hands.

    Parameters
    ----------
    found : OpenLoop
        Outcomes of all samples.
    out : Console
        Console to print on.
    """
    along, across = 1e3 * found.position, 1e3 * found.height
    about, around = 1e3 * found.tilt, 1e3 * found.yaw
    out.print(
        f"executed as planned with each hand displaced by up to {along:g} mm in x and y, "
        f"{across:g} mm in z, {about:g} mrad about x and y, {around:g} mrad about z, "
        f"{len(found.samples)} samples:"
    )
    said = f"everything holds in {found.holds:.0%}"
    said += f"; tiles are dragged backwards in {found.dragged}" if found.dragged else ""
    said += f"; no equilibrium in {found.without}" if found.without else ""
    out.print(said + _refused(found.refused, found.reasons))
    dragged = [sample.dragged for sample in found.samples if sample.dragged is not None]
    quantiles = (found.tenth, found.median, found.ninetieth)
    row = (
        *("none" if used is None else f"{used:.3f}" for used in quantiles),
        f"{max(dragged):.1f}" if dragged else "none",
        found.worst_limb or "none",
    )
    heads = ("util 10 %", "50 %", "90 %", "dragged N")
    print_rows([row], in_order(heads, texts=["worst hand"]), out, result=True)


def print_survival(found: planner.Survival, out: Console) -> None:
    """Print how likely it is that no tile slips, and that all hands hold if some do.

    Parameters
    ----------
    found : Survival
    out : Console
        Console to print on.
    """
    out.print(
        f"strengths {found.strength:g} times those assumed, Weibull modulus {found.moduli}, "
        f"scatter of holds {found.hold_scatter:g}, of the rock {found.rock_scatter:g}:"
    )
    _print_no_slip("no tile and no palm slips", found, found.strength, out)
    if found.reason is not None:
        out.print(found.reason)
        return
    simulated = (
        ("something slips", found.slipped),
        ("all hold, tensions fixed", found.holds),
        (f"all hold, new set-points {_when(found.delay)} after each slip", found.replanned),
    )
    columns = (
        name("simulated", "0"),
        number("share", "1.probability", ".3f"),
        *(number(end, f"1.{end}", ".3f") for end in ("low", "high")),
        number("draws", "1.draws"),
    )
    print_rows([row for row in simulated if row[1] is not None], columns, out, result=True)
    if found.first:
        likely = ", ".join(f"{tile} {share:.3f}" for tile, share in list(found.first.items())[:4])
        out.print(f"slips first, with a probability of: {likely}")


def _print_no_slip(
    what: str, found: planner.Survival | planner.RouteSurvival, strength: float, out: Console
) -> None:
    """Print the probability of the formula, and the strengths for which it is 0.9 and 0.99."""
    rows = [
        (f"{strength:g}", f"{found.no_slip:.3f}"),
        (f"{found.strength_90:.2f}", "0.9"),
        (f"{found.strength_99:.2f}", "0.99"),
    ]
    print_rows(rows, in_order((), ("times the assumed strength", what)), out, result=True)


def _when(delay: float) -> str:
    return f"{delay:g} s" if delay else "at once"


def print_route_survival(found: planner.RouteSurvival, out: Console) -> None:
    """Print the survival of a climb: one row a stage, all stages together, and the worst.

    Parameters
    ----------
    found : RouteSurvival
    out : Console
        Console to print on.
    """
    worst, fixed, anew = found.stages[found.worst], "survival.holds", "survival.replanned"
    columns = (
        *map(name, ("move", "phase", "limb")),
        number("util", _used),
        number("no slip", "survival.no_slip", ".3f"),
        number("fixed", f"{fixed}.probability", ".3f"),
        number("95 %", fixed, _ends),
        number("new points", f"{anew}.probability", ".3f"),
        number("95 %", anew, _ends),
    )
    print_rows(
        found.stages,
        columns,
        out,
        style=lambda stage: "bold" if stage is worst else "",
        legend=["all hands hold, with fixed tensions, and with new set-points after each slip"],
    )
    if found.reason is not None:
        out.print(found.reason)
    if found.no_slip is not None:
        known = [stage.survival for stage in found.stages if stage.survival is not None]
        _print_no_slip("no slip in any stage", found, known[0].strength, out)
    for what, whole in (("tensions fixed", found.holds), ("new set-points", found.replanned)):
        if whole is not None:
            out.print(
                f"all hold in every stage, {what}: {whole.all_stages.probability:.3f} "
                f"({_ends(whole.all_stages, 3)}) of {whole.all_stages.draws} draws; at most "
                f"{whole.least:.3f}, the least of the stages; {whole.product:.3f} if "
                "each stage drew anew"
            )
    out.print(f"worst: {joined(str(worst.move or ''), worst.phase, worst.limb)}")


def _used(stage: planner.StageSurvival) -> str:
    """Return a stage's utilisation, with a star beyond the cap; its status where it has no plan."""
    if stage.survival is None or stage.utilisation is None:
        return stage.status
    return f"{stage.utilisation:.2f}" + ("" if stage.status == "optimal" else "*")


def _ends(share: planner.SurvivalShare, digits: int = 2) -> str:
    return f"{share.low:.{digits}f}–{share.high:.{digits}f}"


def _refused(limbs: Mapping[str, int], reasons: Mapping[str, str] = MappingProxyType({})) -> str:
    why = {limb: f" ({reason})" for limb, reason in reasons.items()}
    each = ", ".join(f"{limb} in {n}{why.get(limb, '')}" for limb, n in limbs.items())
    return f"; hands that cannot be there: {each}" if each else ""


def _digits(spread: planner.Quantiles) -> int:
    """Return the first decimal in which an interval's ends differ, from 1 to 3."""
    wide = spread.high - spread.low
    first = 3 if wide <= 0.0 else math.ceil(-math.log10(wide))
    return min(max(first, 1), 3)


def _interval(spread: planner.Quantiles, digits: int | None = None) -> str:
    """Return an interval as text, or one number where its ends do not differ."""
    digits = _digits(spread) if digits is None else digits
    low, high = f"{spread.low:.{digits}f}", f"{spread.high:.{digits}f}"
    return low if low == high else f"{low} to {high}"
