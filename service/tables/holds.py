"""Print and draw holds that were found on rock, and convert them into JSON values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rich.console import Console

from hand_models.base import Array, InvalidInputError, RefusedPlaceError
from hand_models.fixed_wrist import (
    AT_HOLE,
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
    from hand_models.rock import Mesh

__all__ = ["draw_holds", "hold_json", "print_holds", "refusal_kind", "refusals_json"]

SHOWN_HOLDS: Final = 10
"""Number of the best holds that are printed, and drawn."""

Point = tuple[float, float, float]
Outcomes = Mapping[int, FoundHold | InvalidInputError]
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


def refusals_json(trials: Sequence[HoldTrial], outcomes: Outcomes) -> dict[str, Any]:
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
    kinds: dict[Point, Counter[str]] = {}
    found: dict[Point, Counter[str]] = {}
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
    print_rows(found[:SHOWN_HOLDS], columns, out, legend=legend)
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
    holes = result["reasons"].get(AT_HOLE, 0)
    if holes:
        out.print(
            f"{holes:,} of these places are at holes of the scan, away from its outline; a larger "
            "--hole of `crux rock` may close them"
        )


def _ways(ways: Iterable[str]) -> str:
    """Return directions of forces in short: ``-z ±x +y``."""
    signs: dict[str, str] = {}
    for way in ways:
        signs[way[-1]] = "±" if way[-1] in signs else way[0]
    return " ".join(f"{sign}{axis}" for axis, sign in signs.items()) or "-"


def _finite(value: float) -> str:
    return f"{value:z.1f}" if math.isfinite(value) else "-"


def draw_holds(
    mesh: Mesh,
    trials: Sequence[HoldTrial],
    outcomes: Outcomes,
    found: Sequence[Pair],
    result: Mapping[str, Any],
    path: Path,
) -> None:
    """Draw the best hold at each point, and points without one, as a picture or as a page.

    Parameters
    ----------
    mesh : Mesh
        The rock.
    trials : sequence of HoldTrial
        Places and grasps that were tried.
    outcomes : mapping of int to FoundHold or InvalidInputError
        Outcome of each trial, by its index.
    found : sequence of (HoldTrial, FoundHold)
        Holds, the best first.
    result : mapping
        Content of the file of the holds, as in `print_holds`.
    path : Path
        File to write; a page if it ends in ``.html``.
    """
    label, first = _values(found, result)
    marks = _marks(trials, outcomes, {point: value for point, (_, value) in first.items()})
    known = {point: each for point, each in first.items() if not math.isnan(each[1])}
    values, name = [value for _, value in known.values()], f"holds on {Path(result['rock']).name}"
    if path.suffix.lower() != ".html":
        from hand_models.scans import plot_holds

        refused = {f"{words} ({len(at)})": np.array(at) for words, at in marks}
        points, best = np.array(list(known)).reshape(-1, 3), found[:SHOWN_HOLDS]
        poses, title = [each.pose for _, each in best], f"{name}: the best hand at each point"
        plot_holds(mesh.triangles, points, np.array(values), refused, poses, path, title, label)
        return
    import planner

    way, degree, most = result["direction"], 180.0 / math.pi, 500  # rows of the table
    columns = "hold,x [m],y [m],z [m],wrist [°],outer fingers [°]"
    columns += f",{way} alone [N],{way} with others [N],{way} alone in 9 of 10 [N],share [%]"
    rows: list[list[Any]] = []
    for i, hold in enumerate(result["holds"][:most], 1):
        turns = hold["place"]["wrist_angle"], hold["grasp"]["outer_rotation"]
        row = [i, *hold["place"]["point"], *(degree * turn for turn in turns)]
        row += [hold["pure"][way], hold["support"][way]]
        tenth, share = hold["pure_tenth"], hold["share"]
        row += [tenth and tenth[way], None if share is None else 100.0 * share[way]]
        rows.append(row)
    reasons = {tuple(each["point"]): each["reasons"] for each in result["refusals"]}
    texts = [
        f"hold {i + 1}\n{label}: {value:.1f}\nwrist {degree * found[i][0].wrist_angle:.0f}°, outer "
        f"fingers {degree * found[i][0].outer_rotation:.0f}°"
        for i, value in known.values()
    ]
    groups = [planner.PlaceGroup("holds", list(known), texts, values, label)] if known else []
    for words, places in marks:
        whys = (reasons.get(at, {}).items() for at in places)
        texts = ["\n".join(f"{n} × {why}" for why, n in each) or words for each in whys]
        groups.append(planner.PlaceGroup(words, places, texts))
    said = [
        f"{result['tried']:,} hands were tried, {result['refused']:,} of them cannot be where they "
        f"were tried, {len(found):,} hold something.",
        "A point has the colour of its best hand.",
        *result["warnings"],
    ]
    title = f"The best {most} holds" if len(found) > most else "Holds"
    table = planner.PageTable(title, columns, rows)
    planner.write_holds_page(mesh.triangles, groups, table, path, name, said)


def _values(
    found: Sequence[Pair], result: Mapping[str, Any]
) -> tuple[str, dict[Point, tuple[int, float]]]:
    """Return what is drawn of holds, in words, and each point's best hold with its value.

    Nine in ten samples have a force where nine in ten hold, so shares are drawn.
    """
    way = result["direction"]
    k, first = list(TRIAL_WAYS).index(way), dict[Point, tuple[int, float]]()
    for i, (trial, each) in enumerate(found):
        share = math.nan if each.robust is None else 100.0 * each.robust.share[k]
        values = {"pure": np.fmax(each.pure[k], 0.0), "support": each.support[k]}
        first.setdefault(trial.point, (i, float(values.get(result["sort"], share))))
    labels = {
        "pure": f"force along {way} alone [N], 0 without any",
        "support": f"largest force along {way} [N]",
    }
    words = f"samples that hold the force along {way} alone [%]"
    return labels.get(result["sort"], words), first


def _marks(
    trials: Sequence[HoldTrial],
    outcomes: Outcomes,
    values: Mapping[Point, float],
) -> list[tuple[str, list[Point]]]:
    """Return points without a value by what they are, in words; the kind with most points first.

    A point without a hold has the kind of reason of most of its trials.
    """
    kinds: dict[Point, Counter[str]] = {}
    for i, outcome in sorted(outcomes.items()):
        if trials[i].point not in values:
            kinds.setdefault(trials[i].point, Counter())[refusal_kind(outcome)] += 1
    marked: dict[str, list[Point]] = {}
    for point, counts in kinds.items():
        words = REFUSAL_WORDS[counts.most_common(1)[0][0]]
        marked.setdefault(words, []).append(point)
    unknown = [point for point, value in values.items() if math.isnan(value)]
    if unknown:
        marked["a hand holds something; no samples were tried"] = unknown
    return sorted(marked.items(), key=lambda each: -len(each[1]))
