"""Fig. 14: the phalanx that fails first over the wrench space, and the best planes of loading.

The gripper on surfaces of two diameters is loaded along evenly spread directions with F_z ≤ 0 until
a tile fails: each direction shows which phalanx fails first. A plane F_x : M_y = const. cuts the
hull of Fig. 9's procedure in a slice; the best planes are those whose slices have the greatest
force, √(F_x² + F_z²), and the greatest moment. A cable anchored at a distance a behind the palm
loads the plane M_y = a F_x.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import BASE_TOLERANCES, Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import (
    PHALANX_COLOURS,
    Conditions,
    Role,
    StudyResult,
    StudyText,
    clipped_vertices,
    explored,
    extents,
    label_solid,
    panels,
    part,
    section,
    volume,
)
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["loading_planes", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute failing phalanges and best planes of loading for each diameter and tension."""
    table = experiment_table()
    diameters, tension = table.vector("fig14", "diameters"), table.scalar("fig14", "tension")
    larger = max(diameters)
    cases = [
        *(Conditions(diameter, tension, "sandpaper-36") for diameter in diameters),
        *(
            Conditions(larger, held, "sandpaper-36")
            for held in table.vector("fig14", "other_tensions")
        ),
    ]
    surfaces, steps = [], 1000  # of progress in all
    for done, conditions in enumerate(cases):
        start, end = (steps * i // len(cases) for i in (done, done + 1))
        surfaces.append(_surface(conditions, hand, part(progress, start, end, steps)))
    progress(steps, steps)
    # the two diameters with the same tension come first
    text, of_diameters = StudyText("fig14"), surfaces[:2]
    _check_failures(text, *of_diameters)
    _check_planes(text, of_diameters, table)
    _check_sizes(text, *surfaces)
    return text.result({"phalanges": PHALANGES, "surfaces": surfaces})


def _surface(conditions: Conditions, hand: ParameterTable, progress: Progress) -> dict[str, Any]:
    """Return hull, failures and planes of the gripper on one surface."""
    gripper = conditions.gripper(gripper_table(hand))
    _, pulled, wrenches = explored(gripper, STUDY_SETTINGS.fig14_pulls, progress)
    shown = clipped_vertices(wrenches)
    # in an order that is everyone's
    shown = shown[np.lexsort(shown.T)]
    # in how many of the directions each phalanx fails in each way
    counts = Counter(zip(pulled.phalanx, pulled.way, strict=True))
    return {
        "diameter": conditions.diameter,
        "tension": conditions.tension,
        "hull_vertices": shown,
        "extents": extents(shown)._asdict(),
        "volume": volume(shown),
        "pulls": {
            "wrenches": pulled.wrenches,
            "side": pulled.side,
            "phalanx": pulled.phalanx,
            "way": pulled.way,
        },
        "shares": [
            {"phalanx": phalanx, "way": way, "share": count / len(pulled.way)}
            for (phalanx, way), count in counts.most_common()
        ],
        "planes": loading_planes(shown),
        "best_pulls": _best(pulled.wrenches),
    }


def loading_planes(points: Array) -> dict[str, Any]:
    """Return the greatest force and moment of a hull in planes M_y = a F_x, and the best planes.

    Both √(F_x² + F_z²) and the magnitude of M_y are convex, so that the best are at vertices of the
    hull.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches of the part F_z ≤ 0 [N, N, N·m].

    Returns
    -------
    dict
        ``arm``: values of a, one for each plane [m]; ``force`` [N] and ``moment`` [N·m]: the
        greatest in each plane;
        ``best_for_force`` and ``best_for_moment``: the best over all planes, with
        ``arms_as_good``, the range of arms within 1 % of the best.
    """
    size = np.abs(points).max(axis=0)
    turns = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)[1:-1]
    arms = np.tan(turns) * size[2] / size[0]
    slices = [_strengths(section(points, (arm, 0.0, -1.0))) for arm in arms]
    planes: dict[str, Any] = {"arm": arms}
    for name in ("force", "moment"):
        planes[name] = np.array([strengths[name].max(initial=0.0) for strengths in slices])
    for name, best in _best(points).items():
        good = arms[planes[name] >= (1.0 - 0.01) * best[name]]  # within 1 % of the best
        alike = [good.min(), good.max()] if len(good) else None
        planes[f"best_for_{name}"] = {**best, "arms_as_good": alike}
    return planes


def _strengths(points: Array) -> dict[str, Array]:
    """Return what wrenches count for, by force and by moment."""
    return {"force": np.hypot(points[:, 0], points[:, 1]), "moment": np.abs(points[:, 2])}


def _best(points: Array) -> dict[str, dict[str, Any]]:
    """Return the wrenches of the greatest force and of the greatest moment, and their planes."""
    found = {}
    for name, strengths in _strengths(points).items():
        # of a wrench and its mirror image, which are as strong, that to the right
        most = strengths.max()
        alike = points[strengths >= (1.0 - BASE_TOLERANCES.relative) * most]
        best = alike[alike[:, 0].argmax()]
        found[name] = {
            "wrench": best,
            name: most,
            "arm": best[2] / best[0],
            "ratio": best[0] / best[2],
        }
    return found


def _listed(surface: dict[str, Any]) -> str:
    return ", ".join(
        f"{entry['phalanx'] or 'none'} {100 * entry['share']:.1f} % "
        f"({entry['way'].replace('_', ' ')})"
        for entry in surface["shares"]
    )


def _check_failures(text: StudyText, near: dict[str, Any], far: dict[str, Any]) -> None:
    wrenches, _, phalanges, _ = near["pulls"].values()
    proximal = phalanges.count("proximal") > 0.5 * len(phalanges)
    text.check("proximal_first", _listed(near), proximal)
    arms, distal = np.abs(wrenches[:, 2] / wrenches[:, 0]), np.array(phalanges) == "distal"
    given, small = "no distal failure", False
    if distal.any():
        here, others = np.median(arms[distal]), np.median(arms[~distal])
        given = f"median M_y : F_x {1e3 * here:.1f} mm, {1e3 * others:.1f} mm where others fail"
        small = bool(here < others)
    text.check("distal_where", given, small)
    beside = ("dragged_backwards", "no_pose")  # no limits of a tile
    limits = [entry for entry in far["shares"] if entry["way"] not in beside]
    mine = sum(entry["share"] for entry in limits if entry["phalanx"] == "proximal")
    letting_go = mine / sum(entry["share"] for entry in limits) if limits else 0.0
    given = f"{_listed(far)}; of tiles that let go {100 * letting_go:.1f} %"
    text.check("proximal_only", given, set(far["pulls"]["phalanx"]) == {"proximal"})


def _check_planes(text: StudyText, surfaces: list[dict[str, Any]], table: ParameterTable) -> None:
    fitted = table.scalar("fig13", "diameter")
    about = 0.25  # share within which a figure printed as "about" is met
    for surface in surfaces:
        where = f"on {1e3 * surface['diameter']:g} mm"
        # the gripper's numbers were fitted to those planes on the surface of Fig. 13
        role: Role = "calibration" if surface["diameter"] == fitted else "test"
        planes, ratios = surface["planes"], []
        for name, aim in (("force", "point force"), ("moment", "moment")):
            best, printed = planes[f"best_for_{name}"], table.scalar("fig14", f"{name}_ratio")
            there = np.interp(1.0 / printed, planes["arm"], planes[name]) / best[name]
            ratio = best["ratio"]
            given = (
                f"{ratio:.3g} : 1 (M_y : F_x {1e3 * best['arm']:.1f} mm); at {printed:g} : 1 "
                f"{100 * there:.1f} % of the best; best of straight pulls "
                f"{surface['best_pulls'][name]['ratio']:.3g} : 1"
            )
            holds = abs(ratio - printed) <= about * printed
            words: dict[str, Any] = {"where": where, "aim": aim, "printed": printed}
            text.check("best_plane", given, holds, role=role, about=100 * about, **words)
            ratios.append(ratio)
        force, moment = ratios
        given = f"{force:.3g} : 1 for force, {moment:.3g} : 1 for moment"
        text.check("higher_for_force", given, 0.0 < moment < force, where=where)
    anchor, best = table.scalar("fig14", "anchor"), surfaces[0]["planes"]["best_for_force"]
    span = "nowhere else"
    if best["arms_as_good"]:
        span = "from {:.2f} to {:.2f} cm".format(*(100 * arm for arm in best["arms_as_good"]))
    given = f"{100 * best['arm']:.2f} cm; within 1 % of the best {span}"
    holds = abs(best["arm"] - anchor) <= about * anchor
    text.check("anchor", given, holds, anchor=100 * anchor, about=100 * about)


def _check_sizes(text: StudyText, near: dict[str, Any], *others: dict[str, Any]) -> None:
    for surface in others:
        of = [surface["extents"][name] / near["extents"][name] for name in near["extents"]]
        size = surface["volume"] / near["volume"]
        shares = zip(("F_x", "F_z", "M_y"), of, strict=True)
        given = ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares)
        given += f", volume {100 * size:.0f} % of that on 300 mm"
        tensions = {"far": surface["tension"], "near": near["tension"]}
        text.check("smaller", given, max(*of, size) < 1.0, **tensions)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the failing phalanges over the wrench spaces, and the force and moment in each plane."""
    surfaces = result.data["surfaces"]
    of_diameters = surfaces[:2]
    return {"fig14": _draw_failures(of_diameters), "fig14_planes": _draw_planes(surfaces)}


def _name(surface: dict[str, Any]) -> str:
    return f"{1e3 * surface['diameter']:g} mm, {surface['tension']:g} N"


def _draw_failures(surfaces: list[dict[str, Any]]) -> Figure:
    figure, text = Figure(figsize=(15.0, 9.0), layout="constrained"), StudyText("fig14")
    for row, surface in enumerate(surfaces):
        solid: Any = figure.add_subplot(2, 3, 3 * row + 1, projection="3d")
        top, side = (figure.add_subplot(2, 3, 3 * row + k) for k in (2, 3))
        wrenches = surface["pulls"]["wrenches"]
        fails = np.array(surface["pulls"]["phalanx"])
        dragged = np.array(surface["pulls"]["way"]) == "dragged_backwards"
        for phalanx, colour in PHALANX_COLOURS.items():
            for marker, those, how in (
                (".", ~dragged, "lets go"),
                ("x", dragged, "dragged backwards"),
            ):
                x, z, moment = wrenches[(fails == phalanx) & those].T
                if len(x):
                    style: dict[str, Any] = {
                        "color": colour,
                        "marker": marker,
                        "label": f"{phalanx} {how}",
                    }
                    solid.scatter(x, moment, z, s=12, depthshade=False, **style)
                    top.scatter(x, moment, s=14, **style)
                    side.scatter(x, z, s=14, **style)
        low, high = wrenches.min(axis=0), wrenches.max(axis=0)
        ends = np.array([low[0], high[0]])
        for key, line in (("force", "k--"), ("moment", "k:")):
            best = surface["planes"][f"best_for_{key}"]
            top.plot(ends, best["arm"] * ends, line, label=f"best for {key}: {best['ratio']:.3g}:1")
        top.set_ylim(1.15 * low[2], 1.9 * high[2])
        label_solid(solid, f"{_name(surface)}: first failure, F_z downward")
        for axes, view in ((top, "top"), (side, "side")):
            text.label(axes, view, surface=_name(surface))
            axes.grid(alpha=0.3)
        top.legend(fontsize=8, loc="upper left")
    return figure


def _draw_planes(surfaces: list[dict[str, Any]]) -> Figure:
    figure, both = panels(1, 2, (12.0, 4.4))
    strengths = {"force": "largest √(F_x² + F_z²) [N]", "moment": "largest M_y [N·m]"}
    for axes, (key, strength) in zip(both, strengths.items(), strict=True):
        for surface in surfaces:
            planes = surface["planes"]
            (line,) = axes.plot(1e3 * planes["arm"], planes[key], label=_name(surface))
            best = planes[f"best_for_{key}"]
            axes.plot(1e3 * best["arm"], best[key], "o", color=line.get_color())
        axes.set(xlim=(-60.0, 90.0), ylim=(0.0, None))
        StudyText("fig14").label(axes, "planes", strength=strength)
        axes.legend()
    return figure
