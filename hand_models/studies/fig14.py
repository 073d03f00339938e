"""Fig. 14: the phalanx that fails first over the wrench space, and the best planes of loading.

The gripper on surfaces of two diameters is loaded along evenly spread directions with F_z ≤ 0 until
a tile fails: each direction shows which phalanx fails first. A plane F_x : M_y = const. cuts the
hull of Fig. 9's procedure in a slice; the best planes are those whose slices have the greatest
force, √(F_x² + F_z²), and the greatest moment. A cable anchored at a distance a behind the palm
loads the plane M_y = a F_x.
"""

from __future__ import annotations

import collections
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import Conditions, Role, StudyResult, StudyText, loading_planes
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["loading_planes", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute failing phalanges and best planes of loading for each diameter and tension."""
    table = experiment_table()
    diameters, tension = table.vector("fig14", "diameters"), table.scalar("fig14", "tension")
    cases = [(diameter, tension) for diameter in diameters]
    cases += [(max(diameters), other) for other in table.vector("fig14", "other_tensions")]
    surfaces = []
    for done, case in enumerate(cases):
        report = experiments.part(progress, 1000 * done, 1000 * (done + 1), 1000 * len(cases))
        surfaces.append(_surface(Conditions(*case, "sandpaper-36"), hand, report))
    return _checked(surfaces, table)


def _surface(conditions: Conditions, hand: ParameterTable, progress: Progress) -> dict[str, Any]:
    """Return hull, failures and planes of the gripper on one surface."""
    gripper = conditions.gripper(gripper_table(hand))
    _, pulled, wrenches = experiments.explored(gripper, STUDY_SETTINGS.fig14_pulls, progress)
    shown = experiments.clipped_vertices(wrenches)
    # in an order that is everyone's
    shown = shown[np.lexsort(shown.T)]
    # in how many of the directions each phalanx fails in each way
    counts = collections.Counter(zip(pulled.phalanx, pulled.way, strict=True))
    return {
        "diameter": conditions.diameter,
        "tension": conditions.tension,
        "hull_vertices": shown,
        "extents": experiments.extents(shown)._asdict(),
        "volume": experiments.volume(shown),
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
        "best_pulls": experiments.strongest(pulled.wrenches),
    }


def _listed(surface: dict[str, Any]) -> str:
    return ", ".join(
        f"{entry['phalanx'] or 'none'} {100 * entry['share']:.1f} % "
        f"({entry['way'].replace('_', ' ')})"
        for entry in surface["shares"]
    )


def _checked(surfaces: list[dict[str, Any]], table: ParameterTable) -> StudyResult:
    # the two diameters with the same tension come first
    text, (near, far, *_) = StudyText("fig14"), surfaces
    phalanges = np.array(near["pulls"]["phalanx"])
    text.check("proximal_first", (phalanges == "proximal").mean() > 0.5, got=_listed(near))
    force_x, _, moment = near["pulls"]["wrenches"].T
    arms, distal = 1e3 * np.abs(moment / force_x), phalanges == "distal"
    if distal.any():
        here, others = np.median(arms[distal]), np.median(arms[~distal])
        text.check("distal_where", here < others, here=here, others=others)
    else:
        text.check("distal_where", False, got="no distal failure")
    proximal = np.array(far["pulls"]["phalanx"]) == "proximal"
    # by a limit of a tile
    let_go = ~np.isin(far["pulls"]["way"], ("dragged_backwards", "no_pose"))
    letting_go = 100 * proximal[let_go].mean() if let_go.any() else 0.0
    text.check("proximal_only", proximal.all(), shares=_listed(far), letting_go=letting_go)
    fitted = table.scalar("fig13", "diameter")
    about = 0.25  # share within which a figure printed as "about" is met
    for surface in (near, far):
        where = f"on {1e3 * surface['diameter']:g} mm"
        # the gripper's numbers were fitted to those planes on the surface of Fig. 13
        role: Role = "calibration" if surface["diameter"] == fitted else "test"
        planes, ratios = surface["planes"], {}
        for name, aim in (("force", "point force"), ("moment", "moment")):
            best, printed = planes[f"best_for_{name}"], table.scalar("fig14", f"{name}_ratio")
            there = np.interp(1.0 / printed, planes["arm"], planes[name]) / best[name]
            ratios[name] = ratio = best["ratio"]
            pulled = surface["best_pulls"][name]["ratio"]
            found = {"ratio": ratio, "arm": 1e3 * best["arm"], "there": 100 * there}
            found |= {"printed": printed, "about": 100 * about, "pulled": pulled}
            holds = abs(ratio - printed) <= about * printed
            text.check("best_plane", holds, role=role, where=where, aim=aim, **found)
        holds = 0.0 < ratios["moment"] < ratios["force"]
        text.check("higher_for_force", holds, where=where, **ratios)
    anchor, best = table.scalar("fig14", "anchor"), near["planes"]["best_for_force"]
    arm, span = best["arm"], "nowhere else"
    if best["arms_as_good"]:
        span = "from {:.2f} to {:.2f} cm".format(*(100 * arm for arm in best["arms_as_good"]))
    found = {"arm": 100 * arm, "anchor": 100 * anchor, "about": 100 * about}
    text.check("anchor", abs(arm - anchor) <= about * anchor, span=span, **found)
    sizes = {**near["extents"], "volume": near["volume"]}
    for surface in surfaces[1:]:
        here = {**surface["extents"], "volume": surface["volume"]}
        shares = {name: 100 * here[name] / size for name, size in sizes.items()}
        tensions = {"far": surface["tension"], "near": near["tension"]}
        text.check("smaller", max(shares.values()) < 100.0, **shares, **tensions)
    return text.result({"phalanges": PHALANGES, "surfaces": surfaces})


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the failing phalanges over the wrench spaces, and the force and moment in each plane."""
    surfaces = result.data["surfaces"]
    return {"fig14": _draw_failures(surfaces[:2]), "fig14_planes": _draw_planes(surfaces)}


def _name(surface: dict[str, Any]) -> str:
    return f"{1e3 * surface['diameter']:g} mm, {surface['tension']:g} N"


def _draw_failures(surfaces: list[dict[str, Any]]) -> Figure:
    figure, axes = experiments.panels(2, 3, (15.0, 9.0), solids=(0, 3))
    text = StudyText("fig14")
    for surface, solid, top, side in zip(surfaces, axes[::3], axes[1::3], axes[2::3], strict=True):
        wrenches, name = surface["pulls"]["wrenches"], _name(surface)
        fails, ways = (np.array(surface["pulls"][key]) for key in ("phalanx", "way"))
        dragged = ways == "dragged_backwards"
        for phalanx, colour in experiments.PHALANX_COLOURS.items():
            for marker, how, at in (
                (".", "lets go", ~dragged),
                ("x", "dragged backwards", dragged),
            ):
                x, z, moment = wrenches[(fails == phalanx) & at].T
                style: Any = {"color": colour, "marker": marker, "label": f"{phalanx} {how}"}
                if len(x):
                    solid.scatter(x, moment, z, s=12, depthshade=False, **style)
                    top.scatter(x, moment, s=14, **style)
                    side.scatter(x, z, s=14, **style)
        low, high = wrenches.min(axis=0), wrenches.max(axis=0)
        ends = np.array([low[0], high[0]])
        for key, line in (("force", "k--"), ("moment", "k:")):
            best = surface["planes"][f"best_for_{key}"]
            top.plot(ends, best["arm"] * ends, line, label=f"best for {key}: {best['ratio']:.3g}:1")
        top.set_ylim(1.15 * low[2], 1.9 * high[2])
        experiments.label_solid(solid, f"{name}: first failure, F_z downward")
        text.label(top, "top", surface=name)
        text.label(side, "side", surface=name)
    return figure


def _draw_planes(surfaces: list[dict[str, Any]]) -> Figure:
    figure, both = experiments.panels(1, 2, (12.0, 4.4))
    for axes, key in zip(both, ("force", "moment"), strict=True):
        for surface in surfaces:
            planes = surface["planes"]
            (line,) = axes.plot(1e3 * planes["arm"], planes[key], label=_name(surface))
            best = planes[f"best_for_{key}"]
            axes.plot(1e3 * best["arm"], best[key], "o", color=line.get_color())
        axes.set_ylim(0.0, None)
        StudyText("fig14").label(axes, key)
    return figure
