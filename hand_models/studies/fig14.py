"""Fig. 14: which phalanx fails first over the wrench space, and the best planes of loading.

The gripper on surfaces of two diameters is loaded along evenly spread directions with F_z ≤ 0 until
a tile lets go: each tells which phalanx fails first there. A plane F_x : M_y = const. cuts the hull
of Fig. 9's procedure in a slice; the best planes are those whose slices hold the greatest force,
√(F_x² + F_z²), and the greatest moment. A cable anchored a behind the palm loads the plane
M_y = a F_x.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import Gripper, gripper_table, search
from hand_models.experiments import (
    DRAGGED,
    UNBALANCED,
    Claim,
    Pulled,
    StudyResult,
    clipped_vertices,
    even_pulls,
    extents,
    in_paper_signs,
    label_solid,
    pull,
    save_picture,
    section,
    unloaded,
    volume,
)
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.wrench_spaces import TOLERANCE

__all__ = ["loading_planes", "plot", "run"]

PER_AXIS: Final = 60
"""Poses of the wrist along each axis of the search."""

DIRECTIONS: Final = 600
"""Of loads that are pulled until a tile lets go."""

PLANES: Final = 181
"""Planes of loading that are looked at."""

STEPS: Final = 1000
"""Of the progress told."""

ABOUT: Final = 0.25
"""A figure printed as "about" is met within this share of it."""

FLAT: Final = 0.01
"""Planes are as good as the best within this share."""


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Search the wrench spaces, and pull along directions."""
    table = experiment_table()
    diameters, tension = table.vector("fig14", "diameters"), table.scalar("fig14", "tension")
    larger = max(diameters)
    cases = [
        *((diameter, tension) for diameter in diameters),
        *((larger, other) for other in table.vector("fig14", "other_tensions")),
    ]
    surfaces = []
    for done, (diameter, held) in enumerate(cases):
        gripper = Gripper(diameter, held, table=gripper_table(hand))
        surfaces.append(
            {
                "diameter": diameter,
                "tension": held,
                **_surface(gripper, _part(progress, done, len(cases))),
            }
        )
    progress(STEPS, STEPS)
    data: dict[str, Any] = {
        "phalanges": list(PHALANGES),
        "surfaces": surfaces,
        "not_tested": [
            "that failures in experiments were those predicted: they are not published",
        ],
    }
    claims = (
        *_claims_of_failures(surfaces),
        *_claims_of_planes(surfaces, table),
        *_claims_of_size(surfaces),
    )
    return StudyResult("fig14", "failure modes and planes of loading", data, claims)


def _part(progress: Progress, done: int, total: int) -> Callable[[float], None]:
    """Return what tells the progress of one of several cases, from 0 to 1."""

    def tell(share: float) -> None:
        progress(int(STEPS * (done + min(share, 1.0)) / total), STEPS)

    return tell


def _surface(gripper: Gripper, tell: Callable[[float], None]) -> dict[str, Any]:
    """Return hull, failures and planes of the gripper on one surface."""
    tell(0.0)
    unloaded(gripper)
    found = search(gripper, PER_AXIS)
    tell(0.1)
    shown = clipped_vertices(in_paper_signs(found.wrenches))
    # in an order that is everyone's
    shown = shown[np.lexsort(shown.T)]
    directions = even_pulls(DIRECTIONS, np.abs(shown).max(axis=0))
    pulled = pull(gripper, directions, lambda done: tell(0.1 + 0.9 * float(done.mean())))
    return {
        "hull_vertices": shown.tolist(),
        "extents": extents(shown)._asdict(),
        "volume": volume(shown),
        "pulls": {
            "wrenches": pulled.wrenches.tolist(),
            "side": list(pulled.side),
            "phalanx": list(pulled.phalanx),
            "way": list(pulled.way),
        },
        "shares": _shares(pulled),
        "planes": loading_planes(shown),
        "best_pulls": _best(pulled.wrenches),
    }


def _shares(pulled: Pulled) -> list[dict[str, Any]]:
    """Return the share of the directions in which each phalanx fails in each way."""
    counts = Counter(zip(pulled.phalanx, pulled.way, strict=True))
    return [
        {"phalanx": phalanx, "way": way, "share": count / len(pulled.way)}
        for (phalanx, way), count in counts.most_common()
    ]


def loading_planes(points: Array) -> dict[str, Any]:
    """Return what a hull holds in planes M_y = a F_x, and the best of them.

    Both √(F_x² + F_z²) and |M_y| are convex, so that the best are at vertices of the hull.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Of the part F_z ≤ 0.
    """
    size = np.abs(points).max(axis=0)
    turns = np.linspace(-0.5 * np.pi, 0.5 * np.pi, PLANES)[1:-1]
    arms = np.tan(turns) * size[2] / size[0]
    forces, moments = [], []
    for arm in arms:
        slice_ = section(points, (arm, 0.0, -1.0))
        forces.append(float(np.hypot(slice_[:, 0], slice_[:, 1]).max(initial=0.0)))
        moments.append(float(np.abs(slice_[:, 2]).max(initial=0.0)))
    planes: dict[str, Any] = {"arm": arms.tolist(), "force": forces, "moment": moments}
    for name, best in _best(points).items():
        good = arms[np.array(planes[name]) >= (1.0 - FLAT) * best[name]]
        alike = [float(good.min()), float(good.max())] if len(good) else None
        planes[f"best_for_{name}"] = {**best, "arms_as_good": alike}
    return planes


def _best(points: Array) -> dict[str, dict[str, Any]]:
    """Return the wrenches of the greatest force and of the greatest moment, and their planes."""
    found = {}
    for name, strengths in (
        ("force", np.hypot(points[:, 0], points[:, 1])),
        ("moment", np.abs(points[:, 2])),
    ):
        # of a wrench and its mirror image, which are as strong, that to the right
        most = strengths.max()
        alike = points[strengths >= (1.0 - TOLERANCE) * most]
        best = alike[alike[:, 0].argmax()]
        found[name] = {
            "wrench": best.tolist(),
            name: float(most),
            "arm": float(best[2] / best[0]),
            "ratio": float(best[0] / best[2]),
        }
    return found


def _total(surface: dict[str, Any], phalanx: str) -> float:
    """Return the share of the directions in which a phalanx fails first, in whatever way."""
    phalanges = surface["pulls"]["phalanx"]
    return float(phalanges.count(phalanx) / len(phalanges))


def _letting_go(surface: dict[str, Any], phalanx: str) -> float:
    """Return the share of a phalanx in failures at a tile's limit, none dragged backwards."""
    limits = [entry for entry in surface["shares"] if entry["way"] not in (DRAGGED, UNBALANCED)]
    mine = sum(entry["share"] for entry in limits if entry["phalanx"] == phalanx)
    return float(mine / sum(entry["share"] for entry in limits) if limits else 0.0)


def _listed(surface: dict[str, Any]) -> str:
    return ", ".join(
        f"{entry['phalanx'] or 'none'} {100 * entry['share']:.1f} % "
        f"({entry['way'].replace('_', ' ')})"
        for entry in surface["shares"]
    )


def _claims_of_failures(surfaces: list[dict[str, Any]]) -> list[Claim]:
    near, far = surfaces[:2]
    wrenches = np.array(near["pulls"]["wrenches"])
    arms = np.abs(wrenches[:, 2] / wrenches[:, 0])
    distal = np.array([phalanx == "distal" for phalanx in near["pulls"]["phalanx"]])
    if distal.any():
        here, others = float(np.median(arms[distal])), float(np.median(arms[~distal]))
        told = f"median M_y : F_x {1e3 * here:.1f} mm, {1e3 * others:.1f} mm where others fail"
        small = here < others
    else:
        told, small = "no distal failure", False
    return [
        Claim(
            "on 300 mm most failures start from the proximal phalanx (Section 7)",
            "> 50 % of directions",
            _listed(near),
            _total(near, "proximal") > 0.5,
        ),
        Claim(
            "on 300 mm the distal phalanx fails where M_y is small against F_x (Section 7)",
            "M_y : F_x less than where others fail",
            told,
            small,
        ),
        Claim(
            "on 700 mm the entire wrench space is dominated by proximal failure (Section 7)",
            "proximal in all directions",
            f"{_listed(far)}; of tiles that let go {100 * _letting_go(far, 'proximal'):.1f} %",
            _total(far, "proximal") == 1.0,
        ),
    ]


def _claims_of_planes(surfaces: list[dict[str, Any]], table: ParameterTable) -> list[Claim]:
    claims = []
    for surface in surfaces[:2]:
        where = f"on {1e3 * surface['diameter']:g} mm"
        planes = surface["planes"]
        for name, words in (("force", "point force"), ("moment", "moment")):
            best, printed = planes[f"best_for_{name}"], table.scalar("fig14", f"{name}_ratio")
            there = float(np.interp(1.0 / printed, planes["arm"], planes[name])) / best[name]
            claims.append(
                Claim(
                    f"{where} the best F_x : M_y for {words} is about {printed:g} : 1 (Section 7)",
                    f"{printed:g} within {100 * ABOUT:g} %",
                    f"{best['ratio']:.3g} : 1 (M_y : F_x {1e3 * best['arm']:.1f} mm); at "
                    f"{printed:g} : 1 {100 * there:.1f} % of the best; best of straight pulls "
                    f"{surface['best_pulls'][name]['ratio']:.3g} : 1",
                    abs(best["ratio"] - printed) <= ABOUT * printed,
                )
            )
        force, moment = (planes[f"best_for_{name}"]["ratio"] for name in ("force", "moment"))
        claims.append(
            Claim(
                f"{where} a higher F_x : M_y is better for force, a lower for moment (Section 7)",
                "higher for force",
                f"{force:.3g} : 1 for force, {moment:.3g} : 1 for moment",
                0.0 < moment < force,
            )
        )
    anchor, best = table.scalar("fig14", "anchor"), surfaces[0]["planes"]["best_for_force"]
    claims.append(
        Claim(
            "on 300 mm a cable is best anchored 1.1 cm behind the palm (Section 7)",
            f"{100 * anchor:.1f} cm within {100 * ABOUT:g} %",
            f"{100 * best['arm']:.2f} cm; within 1 % of the best {_span(best['arms_as_good'])}",
            abs(best["arm"] - anchor) <= ABOUT * anchor,
        )
    )
    return claims


def _span(arms: list[float] | None) -> str:
    return f"from {100 * arms[0]:.2f} to {100 * arms[1]:.2f} cm" if arms else "nowhere else"


def _claims_of_size(surfaces: list[dict[str, Any]]) -> list[Claim]:
    near = surfaces[0]
    claims = []
    for surface in surfaces[1:]:
        of = {name: surface["extents"][name] / near["extents"][name] for name in near["extents"]}
        shares = ", ".join(
            f"{name} {100 * of[key]:.0f} %"
            for key, name in (("force_x", "F_x"), ("force_z", "F_z"), ("moment", "M_y"))
        )
        size = surface["volume"] / near["volume"]
        claims.append(
            Claim(
                f"the limit surface on 700 mm at {surface['tension']:g} N is smaller than on "
                f"300 mm at {near['tension']:g} N (Sections 6.3 and 7)",
                "every extent smaller",
                f"{shares}, volume {100 * size:.0f} % of that on 300 mm",
                all(value < 1.0 for value in (*of.values(), size)),
            )
        )
    return claims


COLOURS: Final = dict(zip(PHALANGES, ("tab:red", "tab:green", "tab:blue"), strict=True))
"""Of failures; the paper's are red and blue, too."""


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw the failures over the wrench spaces, and what planes of loading hold."""
    surfaces = result.data["surfaces"]
    return [
        save_picture(_draw_failures(surfaces[:2]), folder / "fig14.png"),
        save_picture(_draw_planes(surfaces), folder / "fig14_planes.png"),
    ]


def _draw_failures(surfaces: list[dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(15.0, 9.0), layout="constrained")
    for row, surface in enumerate(surfaces):
        name = f"{1e3 * surface['diameter']:g} mm, {surface['tension']:g} N"
        solid: Any = figure.add_subplot(2, 3, 3 * row + 1, projection="3d")
        top, side = (figure.add_subplot(2, 3, 3 * row + k) for k in (2, 3))
        wrenches = np.array(surface["pulls"]["wrenches"])
        fails = np.array([phalanx or "" for phalanx in surface["pulls"]["phalanx"]])
        dragged = np.array([way == DRAGGED for way in surface["pulls"]["way"]])
        for phalanx, colour in COLOURS.items():
            for mark, those, words in (
                (".", ~dragged, "lets go"),
                ("x", dragged, "dragged backwards"),
            ):
                x, z, moment = wrenches[(fails == phalanx) & those].T
                if len(x):
                    style: dict[str, Any] = {
                        "color": colour,
                        "marker": mark,
                        "label": f"{phalanx} {words}",
                    }
                    solid.scatter(x, moment, z, s=12, depthshade=False, **style)
                    top.scatter(x, moment, s=14, **style)
                    side.scatter(x, z, s=14, **style)
        low, high = wrenches.min(axis=0), wrenches.max(axis=0)
        for key, line in (("force", "--"), ("moment", ":")):
            best = surface["planes"][f"best_for_{key}"]
            ends = np.array([low[0], high[0]])
            heights = best["arm"] * ends
            top.plot(ends, heights, line, color="k", label=f"best for {key}: {best['ratio']:.3g}:1")
        top.set(xlabel="F_x [N]", ylabel="M_y [N·m]", ylim=(1.15 * low[2], 1.9 * high[2]))
        top.set_title(f"{name}: from above, planes of loading")
        side.set(xlabel="F_x [N]", ylabel="F_z [N]", title=f"{name}: from aside")
        label_solid(solid, f"{name}: first failure, F_z downward")
        top.grid(alpha=0.3)
        side.grid(alpha=0.3)
        top.legend(fontsize=8, loc="upper left")
    return figure


def _draw_planes(surfaces: list[dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    for axes, key, label in zip(
        figure.subplots(1, 2),
        ("force", "moment"),
        ("largest √(F_x² + F_z²) [N]", "largest M_y [N·m]"),
        strict=True,
    ):
        for surface in surfaces:
            planes = surface["planes"]
            name = f"{1e3 * surface['diameter']:g} mm, {surface['tension']:g} N"
            arms = 1e3 * np.array(planes["arm"])
            (line,) = axes.plot(arms, planes[key], label=name)
            best = planes[f"best_for_{key}"]
            axes.plot(1e3 * best["arm"], best[key], "o", color=line.get_color())
        axes.set(
            xlabel="M_y : F_x, where a cable is anchored behind the palm [mm]; dots: best",
            ylabel=label,
            xlim=(-60.0, 90.0),
            ylim=(0.0, None),
        )
        axes.grid(alpha=0.3)
        axes.legend()
    return figure
