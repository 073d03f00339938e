"""Fig. 15: force limits over the tension of the tendons, on 300 and 700 mm of fine concrete.

The shear limit is the largest F_x of the wrench hull with F_z ≤ 0 in the loading plane
F_x = 50 M_y; the pure shear limit, beside it, has F_z = 0 on the same line. The normal limit is the
largest −F_z of the hull. It lies in that plane, too: the hull is skew symmetric, so for every
wrench it has one without F_x and M_y of the same F_z.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, EmptySetError, InvalidInputError, Progress
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import (
    Conditions,
    HullPoints,
    Limit,
    StudyResult,
    StudyText,
    clipped_vertices,
    distance_along,
    limit,
    panels,
    rest_state,
    sharpened,
    track,
    volume,
)
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the gripper's shear and normal limits at evenly spaced tensions, on both diameters.

    Raises
    ------
    InvalidInputError
        If the gripper's fingers do not lie on both surfaces, or it holds at no tension.
    """
    table = gripper_table(hand)
    settings = experiment_table()
    least, most = settings.vector("fig15", "tensions")
    tensions = STUDY_SETTINGS.fig15_tensions
    tried = np.linspace(least, most, tensions)
    diameters = settings.vector("parameter_studies", "diameters")
    each = [Conditions(*pair) for pair in itertools.product(diameters, tried.tolist())]
    found = [_at(conditions.gripper(table)) for conditions in track(progress, each)]
    # at each tension; none where nothing holds
    values = ("shear", "pure_shear", "normal", "volume", "pressed_share")
    failing = ("shear_phalanges", "normal_phalanges")
    curves = []
    for i, diameter in enumerate(diameters):
        rows = found[i * tensions : (i + 1) * tensions]
        curves.append(
            {
                "diameter": diameter,
                "state": [row["state"] for row in rows],
                **{key: np.array([row.get(key, np.nan) for row in rows]) for key in values},
                **{key: [row.get(key, []) for row in rows] for key in failing},
                "closing_alone_fails_at": _closing_limit(table, diameter, tried),
            }
        )
    data: dict[str, Any] = {
        "surface": each[0].surface,
        "force_to_moment": settings.scalar("parameter_studies", "force_to_moment"),
        "tension": tried,
        "curves": curves,
    }
    text = StudyText("fig15")
    _check(text, tried, curves)
    return text.result(data)


def _at(grasp: Gripper) -> dict[str, Any]:
    """Return the limits of a gripper, and what is behind them."""
    state = rest_state(grasp)
    cuts, starts = STUDY_SETTINGS.fig15_cuts, STUDY_SETTINGS.fig15_starts
    try:
        points = HullPoints.explored(grasp, STUDY_SETTINGS.fig15_rays)
        points, _ = sharpened(grasp, points, "shear", cuts, starts)
        points, normal = sharpened(grasp, points, "normal", cuts, starts)
        # the points added for one limit may raise the other
        shear = limit(points.wrenches, "shear")
    except EmptySetError:
        return {"state": state}
    ratio = experiment_table().scalar("parameter_studies", "force_to_moment")
    return {
        "state": state,
        "shear": shear.value,
        "pure_shear": distance_along(points.wrenches, np.array([[1.0, 0.0, 1.0 / ratio]]))[0],
        "normal": normal.value,
        "volume": volume(clipped_vertices(points.wrenches)),
        "pressed_share": _pressed_share(grasp, points, shear),
        "shear_phalanges": _phalanges(points, shear),
        "normal_phalanges": _phalanges(points, normal),
    }


def _phalanges(points: HullPoints, found: Limit) -> list[str]:
    """Return whose contacts fail at the corners between which a limit lies."""
    return sorted({points.phalanges[i] or "dragged backwards" for i in found.corners})


def _pressed_share(grasp: Gripper, points: HullPoints, found: Limit) -> float:
    """Return which part of F_x at a limit the normal forces of the contacts make up."""
    right, left = grasp.finger_loads(points.poses[found.corners])
    along = [(-side.normals * side.directions[..., 1]).sum(axis=1) for side in (right, left)]
    return float(found.weights @ (along[0] - along[1])) / found.value if found.value else 0.0


def _closing_limit(table: ParameterTable, diameter: float, tried: Array) -> float | None:
    """Return the tension from which on closing alone overloads a tile, if it is among those tried.

    A tile overloaded from the least tension on counts as that.
    """

    def excess(tension: float) -> float:
        verdict = Conditions(diameter, tension).gripper(table).evaluate(np.zeros((1, 3)))
        return max(float(verdict.utilisation[0]) - 1.0, float(verdict.violation[0]))

    over = [excess(float(tension)) > 0.0 for tension in tried]
    if not any(over):
        return None
    first = over.index(True)
    if first == 0:
        return float(tried[0])
    return float(scipy.optimize.bisect(excess, tried[first - 1], tried[first], xtol=0.1))  # [N]


def _check(text: StudyText, tried: Array, curves: list[dict[str, Any]]) -> None:
    """Hold the sentences of Section 7.1 against the curves, as far as closing alone holds."""
    strong, weak = (_Curve(curve) for curve in curves)
    # share of the largest limit by which one may wander where it is said to fall: hulls are found
    # by local search
    slack = 0.02
    both = strong.holds & weak.holds
    if not both.any():
        raise InvalidInputError(
            f"exceeds a limit at every closing tension from {tried[0]:g} to {tried[-1]:g} N, on a "
            f"surface of {strong.name} or on one of {weak.name}: "
            "take a stronger hand",
            field="hand",
        )
    for curve in (strong, weak):
        best, moderate = curve.best("volume"), curve.last // 2
        widened = curve["volume"][moderate] / curve["volume"][0]
        given = f"{widened:.3g} times as much at {tried[moderate]:g} N as at {tried[0]:g} N"
        text.check("moderate", given, widened > 1.0, where=curve.name)
        given = f"{tried[best]:g} N of {tried[0]:g} to {tried[curve.last]:g} N"
        text.check("not_large", given, 0 < best < curve.last, where=curve.name)
    most, sheared = weak["normal"][weak.last], weak["normal"][weak.best("shear")]
    given = f"{most:.1f} N at {tried[weak.last]:g} N, "
    given += f"{sheared:.1f} N at {tried[weak.best('shear')]:g} N"
    text.check("normal_on_flat", given, most > sheared, where=weak.name)
    for curve in (weak, strong):
        best = curve.best("shear")
        after = curve["shear"][best : curve.last + 1]
        falls = bool((np.diff(after) <= slack * after[0]).all())
        given = f"most, {after[0]:.1f} N, at {tried[best]:g} N; {after[-1]:.1f} N at "
        given += f"{tried[curve.last]:g} N" + ("" if falls else "; not steadily")
        holds = len(after) > 1 and falls and after[-1] < (1.0 - slack) * after[0]
        text.check("reduces_shear", given, holds, where=curve.name)
    for force in ("shear", "normal"):
        high, low = strong[force][both], weak[force][both]
        ratios = low / high
        given = f"{ratios.min():.2f} to {ratios.max():.2f} times that on {strong.name}"
        text.check("lower", given, (low < high).all(), force=force)
        given = (
            f"by {np.ptp(low):.1f} N, on {strong.name} by {np.ptp(high):.1f} N, over the tensions "
            "at which both hold"
        )
        text.check("less_sensitive", given, np.ptp(low) < np.ptp(high), force=force)
    curved, flat = (float(np.mean(curve["pressed_share"][both])) for curve in (strong, weak))
    given = f"{curved:.0%}, {flat:.0%}; mean over the tensions at which both hold"
    text.check("normal_share", given, curved > flat, strong=strong.name, weak=weak.name)
    steps = range(strong.best("shear"), strong.last + 1)
    beyond = [strong[f"{force}_phalanges"][i] for i in steps for force in ("shear", "normal")]
    others = sorted({p for found in beyond for p in found} - {"proximal", "distal"})
    ends = sum("proximal" in found or "distal" in found for found in beyond)
    given = f"at {ends} of {len(beyond)} limits; also: {', '.join(others) or 'nobody'}"
    text.check("ends_fail", given, 2 * ends > len(beyond), where=strong.name)


class _Curve:
    """The limits on a surface, and where closing alone holds."""

    def __init__(self, curve: dict[str, Any]) -> None:
        self.name = f"{1e3 * curve['diameter']:g} mm"
        self.holds = (np.array(curve["state"]) == "holds") & np.isfinite(curve["shear"])
        self.last = int(np.flatnonzero(self.holds)[-1]) if self.holds.any() else 0
        self.curve = curve

    def __getitem__(self, key: str) -> Any:
        return self.curve[key]

    def best(self, key: str) -> int:
        """Return at which of the tensions that hold a value is largest."""
        return int(np.where(self.holds, self.curve[key], -np.inf).argmax())


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the shear and normal limits over the tension, dotted where closing alone fails."""
    data, tension, text = result.data, result.data["tension"], StudyText("fig15")
    figure, both = panels(1, 2, (12.0, 4.8))
    for axes, force in zip(both, ("shear", "normal"), strict=True):
        for curve, colour in zip(
            data["curves"], (COLOUR_OF["blue"], COLOUR_OF["red"]), strict=True
        ):
            values, fails = curve[force], curve["closing_alone_fails_at"]
            held = np.where(np.array(curve["state"]) == "holds", values, np.nan)
            name = f"{1e3 * curve['diameter']:g} mm"
            axes.plot(tension, values, ":", color=colour)
            axes.plot(tension, held, color=colour, label=name)
            if fails is not None:
                axes.axvline(fails, color=colour, alpha=0.4, linestyle="--")
                place = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
                axes.annotate(name, (fails, 0.02), (4.0, 0.0), rotation=90.0, color=colour, **place)
        text.label(axes, force, ratio=data["force_to_moment"])
        axes.set(xlim=(0.0, tension[-1]), ylim=(0.0, None))
        axes.legend(title="diameter")
    figure.suptitle(data["surface"])
    return {"fig15": figure}
