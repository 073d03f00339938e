"""Print holds that were found on rock, and convert them into JSON values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console

from hand_models.base import Array, InvalidInputError, RefusedPlaceError
from hand_models.fixed_wrist import (
    FORCE_TOLERANCE,
    REFUSAL_WORDS,
    TRIAL_WAYS,
    FoundHold,
    HoldRank,
    HoldTrial,
)
from service.tables.layout import name, number, print_rows, print_warnings, text

if TYPE_CHECKING:
    from hand_models.hand import Placing

__all__ = ["hold_json", "print_holds", "refusal_kind", "refusals_json"]

Pair = tuple[HoldTrial, FoundHold]


def hold_json(trial: HoldTrial, found: FoundHold, placing: Placing) -> dict[str, Any]:
    """Return a hold as JSON values in SI units: place, grasp, and what the hand can hold.

    Parameters
    ----------
    trial : HoldTrial
        Place and grasp, in the rock's frame.
    found : FoundHold
        What the hand can hold there.
    placing : {'given', 'contact'}
        Placing of the hand in a request.
    """
    robust, pure = found.robust, _by_way(found.pure)
    quantiles = ("worst", "tenth", "hundredth", "pure_tenth", "share")
    return {
        "place": {
            "point": trial.point,
            "approach": trial.approach,
            "wrist_angle": trial.wrist_angle,
            "frame": "rock",
        },
        "placing": placing,
        "grasp": {"outer_rotation": trial.outer_rotation},
        "pose": {
            "position": found.pose.position.tolist(),
            "orientation": found.pose.quaternion().tolist(),
        },
        "seating": {"rule": found.rule, "backed_off": found.backed_off},
        "support": _by_way(found.support),
        "pure": pure,
        "pure_pull_off": pure["-fz"],
        "cannot": found.cannot,
        "samples": 0 if robust is None else robust.draws,
        **{key: None if robust is None else _by_way(getattr(robust, key)) for key in quantiles},
    }


def _by_way(values: Array) -> dict[str, float | None]:
    return {
        way: value if math.isfinite(value) else None
        for way, value in zip(TRIAL_WAYS, values.tolist(), strict=True)
    }


def refusals_json(
    trials: Sequence[HoldTrial], outcomes: Mapping[int, FoundHold | InvalidInputError]
) -> dict[str, Any]:
    """Return why a hand cannot be at the places that were refused, as JSON values.

    Parameters
    ----------
    trials : sequence of HoldTrial
        Places and grasps that were tried.
    outcomes : mapping of int to FoundHold or InvalidInputError
        Outcome of each trial, by its index.

    Returns
    -------
    dict
        Number of ``refused`` trials, by kind (``kinds``), by reason (``reasons``), and by point
        with both (``refusals``).
    """
    kinds: dict[tuple[float, float, float], Counter[str]] = {}
    found: dict[tuple[float, float, float], Counter[str]] = {}
    for i, each in sorted(outcomes.items()):
        if isinstance(each, InvalidInputError):
            point = trials[i].point
            kinds.setdefault(point, Counter())[refusal_kind(each)] += 1
            found.setdefault(point, Counter())[_reason(each)] += 1
    reasons = sum(found.values(), Counter[str]())
    return {
        "refused": reasons.total(),
        "kinds": dict(sum(kinds.values(), Counter[str]()).most_common()),
        "reasons": dict(reasons.most_common()),
        "refusals": [
            {"point": point, "kinds": dict(kinds[point]), "reasons": dict(reasons)}
            for point, reasons in found.items()
        ],
    }


def refusal_kind(found: FoundHold | InvalidInputError) -> str:
    """Return the kind of reason why there is no hold at a place, of `REFUSAL_WORDS`."""
    if not isinstance(found, InvalidInputError):
        return "holds_nothing"
    return found.reason if isinstance(found, RefusedPlaceError) else "other"


def _reason(error: InvalidInputError) -> str:
    """Return why a hand cannot be at a place, without the numbers."""
    words = str(error).split(":")[-1] if error.field is None else error.message
    return " ".join("…" if any(map(str.isdigit, word)) else word for word in words.split())


def print_holds(
    result: Mapping[str, Any],
    trials: Sequence[HoldTrial],
    found: Sequence[Pair],
    shown: int,
    out: Console,
) -> None:
    """Print the best holds, and why a hand cannot be at other places.

    Parameters
    ----------
    result : mapping
        Content of the file: numbers of trials, how holds are sorted, reasons and warnings.
    trials : sequence of HoldTrial
        Places and grasps that were tried.
    found : sequence of (HoldTrial, FoundHold)
        Holds, the best first.
    shown : int
        Number of holds that are printed.
    out : Console
        Console to print on.
    """
    way: str = result["direction"]
    k, degree = list(TRIAL_WAYS).index(way), 180.0 / math.pi
    columns = [
        name("x, y, z mm", "0.point", lambda at: ", ".join(f"{1e3 * x:z.0f}" for x in at)),
        number("wrist °", "0.wrist_angle", ".0f", scale=degree),
        number("outer °", "0.outer_rotation", ".0f", scale=degree),
        number("pure N", f"1.pure.{k}", _finite),
        number("support N", f"1.support.{k}", "z.1f"),
        name("cannot", lambda row: _ways(row[1].cannot)),
    ]
    if result["samples"]:
        columns[3:3] = [
            number("9 in 10 N", f"1.robust.pure_tenth.{k}", _finite),
            number("share %", f"1.robust.share.{k}", ".0f", scale=100.0),
        ]
    by: HoldRank = result["sort"]
    force = f"{result['force']:g} N"
    words = {
        "robust": f"the force along {way} alone that nine in ten samples hold, then the share of "
        f"samples that hold {force}",
        "share": f"the share of samples that hold {force} along {way} alone",
        "pure": f"the largest force along {way} alone",
        "support": f"the largest force along {way} with whatever else",
    }
    legend = (
        f"sorted by {words[by]}",
        "cannot: directions in H, of pull-off and shear, without any force alone",
    )
    print_rows(found[:shown], columns, out, legend=legend)
    least = FORCE_TOLERANCE
    alone = sum(each.pure[k] >= least for _, each in found)
    points = len({trial.point for trial in trials})
    out.print(
        f"{result['trials']:,} trials at {points:,} points: {len(found):,} hold something, "
        f"{alone:,} of them along {way} alone"
    )
    if not found:
        unrested = "no_rest", "unstable_rest"
        hint = "does z of the file point into the rock, as `crux rock` writes it?"
        if list(result["kinds"])[:1] == ["scan_border"]:
            hint = "is the scan full of holes? `crux rock` says what helps against them"
        elif 2 * sum(result["kinds"].get(kind, 0) for kind in unrested) > result["refused"]:
            hint = (
                "closed hands come to rest nowhere; with --placing given they are tried at their "
                "seats"
            )
        out.print(f"nothing holds: {hint}")
    print_warnings(result["warnings"], out)
    idle = result["tried"] - result["refused"] - len(found)
    without = result["kinds"] | ({"holds_nothing": idle} if idle else {})
    if without:
        words = REFUSAL_WORDS | {"other": "other reasons: see reasons in the file"}
        rows = [(kind, f"{count:,}", words[kind]) for kind, count in without.items()]
        columns = [name("kind", "0"), number("places", "1"), text("why", "2")]
        print_rows(rows, columns, out, "places without a hold")


def _ways(ways: Iterable[str]) -> str:
    """Return directions of forces in short: ``-z ±x +y``."""
    signs: dict[str, str] = {}
    for way in ways:
        signs[way[-1]] = "±" if way[-1] in signs else way[0]
    return " ".join(f"{sign}{axis}" for axis, sign in signs.items()) or "-"


def _finite(value: float) -> str:
    return f"{value:z.1f}" if math.isfinite(value) else "-"
