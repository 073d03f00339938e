"""Fig. 15: force limits over the tension of the tendons, on 300 and 700 mm of fine concrete.

The shear limit is the largest F_x of the wrench hull with F_z ≤ 0 in the loading plane
F_x = 50 M_y; beside it stands that of pure shear, F_z = 0, on the same line. The normal limit is
the largest −F_z of the hull. It lies in that plane, too: the hull is skew symmetric, so beside any
wrench it has one without F_x and M_y that pulls as hard.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import bisect

from hand_models.base import Array, EmptySetError, InvalidInputError, Progress
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import (
    PARAMETER_STUDIES,
    Claim,
    Conditions,
    HullPoints,
    Limit,
    StudyResult,
    clipped_vertices,
    distance_along,
    limit,
    rest_state,
    save_picture,
    sharpened,
    volume,
)
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["plot", "run"]

TENSIONS: Final = 29
"""How many are tried."""

RAYS: Final = 2000
STARTS: Final = 4
"""Of each hull, before its limits are looked for; and of each search for them."""

FORCES: Final = ("shear", "normal")
COLOURS: Final = ("tab:blue", "tab:red")
CLOSE: Final = 0.1
"""Newtons to which the tension is found at which closing alone fails."""

SLACK: Final = 0.02
"""By what share of the largest limit a limit may wander where it is said to fall: hulls are found
by local search."""


def run(
    progress: Progress, hand: ParameterTable, tensions: int = TENSIONS, rays: int = RAYS
) -> StudyResult:
    """Compute the limits at evenly spaced tensions.

    Parameters
    ----------
    progress : Progress
    hand : ParameterTable
    tensions, rays : int, optional
        How many tensions, and rays of each first hull.

    Raises
    ------
    InvalidInputError
        If the gripper does not lie on both surfaces, or holds at no tension.
    """
    table = gripper_table(hand)
    settings = experiment_table()
    least, most = settings.vector("fig15", "tensions")
    tried = np.linspace(least, most, tensions)
    diameters = settings.vector(PARAMETER_STUDIES, "diameters")
    total = len(diameters) * len(tried)
    curves = []
    for number, diameter in enumerate(diameters):
        rows = []
        for i, tension in enumerate(tried):
            progress(number * len(tried) + i, total)
            conditions = Conditions(diameter, float(tension))
            rows.append(_at(conditions.gripper(table), rays))
        curves.append(
            {
                "diameter": diameter,
                **{key: [row[key] for row in rows] for key in rows[0]},
                "closing_alone_fails_at": _closing_limit(table, diameter, tried),
            }
        )
    progress(total, total)
    data: dict[str, Any] = {
        "surface": Conditions(diameters[0], float(tried[0])).surface,
        "force_to_moment": settings.scalar(PARAMETER_STUDIES, "force_to_moment"),
        "tension": tried.tolist(),
        "curves": curves,
        "not_tested": ["how high the printed lines are: the figure has no numbers here"],
    }
    title = "force limits over the tension of the tendons"
    return StudyResult("fig15", title, data, _claims(tried, curves))


def _at(grasp: Gripper, rays: int) -> dict[str, Any]:
    """Return the limits of a gripper, and what is behind them; null where nothing holds."""
    state = rest_state(grasp)
    try:
        points = HullPoints.explored(grasp, rays)
        points, _ = sharpened(grasp, points, "shear", starts=STARTS)
        points, normal = sharpened(grasp, points, "normal", starts=STARTS)
        # the points added for one limit may raise the other
        shear = limit(points.wrenches, "shear")
    except EmptySetError:
        keys = ("shear", "pure_shear", "normal", "volume", "pressed_share")
        nobody: dict[str, list[str]] = {f"{force}_phalanges": [] for force in FORCES}
        return {"state": state, **dict.fromkeys(keys), **nobody}
    ratio = experiment_table().scalar(PARAMETER_STUDIES, "force_to_moment")
    pure = float(distance_along(points.wrenches, np.array([[1.0, 0.0, 1.0 / ratio]]))[0])
    return {
        "state": state,
        "shear": shear.value,
        "pure_shear": pure if np.isfinite(pure) else None,
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
    total = float(found.wrench[0])
    return float(found.weights @ (along[0] - along[1])) / total if total else 0.0


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
    return float(bisect(excess, tried[first - 1], tried[first], xtol=CLOSE))


def _claims(tried: Array, curves: list[dict[str, Any]]) -> tuple[Claim, ...]:
    """Hold the sentences of Section 7.1 against the curves, as far as closing alone holds."""
    strong, weak = (_Curve(tried, curve) for curve in curves)
    both = strong.holds & weak.holds
    if not both.any():
        raise InvalidInputError("closes at none of the tensions without failing", field="hand")
    claims = []
    for curve in (strong, weak):
        best, moderate = curve.best("volume"), curve.last // 2
        widened = float(curve.volume[moderate] / curve.volume[0])
        claims += [
            Claim(
                "moderate finger tendon forces help expand the wrench space (Section 7.1): its "
                f"volume half way to the most tension at which closing alone holds, {curve.name}",
                "more than at the least tension",
                f"{widened:.3g} times as much at {tried[moderate]:g} N as at {tried[0]:g} N",
                widened > 1.0,
            ),
            Claim(
                f"more than large ones do: the tension of most volume, {curve.name}",
                "between the least and the most at which closing alone holds",
                f"{tried[best]:g} N of {tried[0]:g} to {tried[curve.last]:g} N",
                0 < best < curve.last,
            ),
        ]
    claims.append(
        Claim(
            "large tendon actuation may help obtain better normal attachment on lower curvature "
            f"surfaces: normal limit, {weak.name}",
            "more at the most tension than at that of most shear",
            f"{weak.normal[weak.last]:.1f} N at {tried[weak.last]:g} N, "
            f"{weak.normal[weak.best('shear')]:.1f} N at {tried[weak.best('shear')]:g} N",
            bool(weak.normal[weak.last] > weak.normal[weak.best("shear")]),
        )
    )
    claims += [_claim_of_lost_shear(tried, curve) for curve in (weak, strong)]
    for force in FORCES:
        high, low = getattr(strong, force)[both], getattr(weak, force)[both]
        claims.append(
            Claim(
                f"the wrench space for a low curvature surface is lower: {force} limit",
                "lower at every tension",
                f"{np.min(low / high):.2f} to {np.max(low / high):.2f} times that on {strong.name}",
                bool((low < high).all()),
            )
        )
        high_span, low_span = np.ptp(high), np.ptp(low)
        claims.append(
            Claim(
                f"and less sensitive to tendon force variations: {force} limit",
                "varies by less",
                f"by {low_span:.1f} N, on {strong.name} by {high_span:.1f} N, over the tensions at "
                "which both hold",
                bool(low_span < high_span),
            )
        )
    shares = [float(np.mean(curve.pressed_share[both])) for curve in (strong, weak)]
    claims.append(
        Claim(
            "on more curved surfaces the normal force component of the contacts contributes "
            "substantially to attachment: its share of F_x at the shear limit",
            f"more on {strong.name} than on {weak.name}",
            f"{shares[0]:.0%}, {shares[1]:.0%}; mean over the tensions at which both hold",
            shares[0] > shares[1],
        )
    )
    beyond = [
        tuple(found)
        for i in range(strong.best("shear"), strong.last + 1)
        for found in strong.phalanges[i]
    ]
    others = sorted({p for found in beyond for p in found if p not in ("proximal", "distal")})
    ends = [any(p in ("proximal", "distal") for p in found) for found in beyond]
    claims.append(
        Claim(
            "it can lead to premature failure at the distal or proximal phalanx: who fails at the "
            f"limits, {strong.name}, from the tension of most shear on",
            "proximal or distal, at most of the limits",
            f"at {sum(ends)} of {len(ends)} limits; also: {', '.join(others) or 'nobody'}",
            2 * sum(ends) > len(ends),
        )
    )
    return tuple(claims)


def _claim_of_lost_shear(tried: Array, curve: _Curve) -> Claim:
    """Return the claim that beyond its best tension a surface loses shear, and ever more."""
    best = curve.best("shear")
    after = curve.shear[best : curve.last + 1]
    falls = bool((np.diff(after) <= SLACK * after[0]).all())
    return Claim(
        f"but large tendon actuation gradually reduces shear loading capability: {curve.name}",
        "less and less from some tension on",
        f"most, {after[0]:.1f} N, at {tried[best]:g} N; {after[-1]:.1f} N at "
        f"{tried[curve.last]:g} N" + ("" if falls else "; not steadily"),
        len(after) > 1 and falls and bool(after[-1] < (1.0 - SLACK) * after[0]),
    )


class _Curve:
    """The limits on a surface, over the tensions at which closing alone holds."""

    def __init__(self, tried: Array, curve: dict[str, Any]) -> None:
        self.name = f"{1e3 * curve['diameter']:g} mm"
        values = {
            key: np.array(curve[key], dtype=float)
            for key in ("shear", "normal", "volume", "pressed_share")
        }
        held = [state == "holds" for state in curve["state"]]
        self.holds = np.array(held) & np.isfinite(values["shear"])
        self.last = int(np.flatnonzero(self.holds)[-1]) if self.holds.any() else 0
        self.values = values
        self.phalanges = list(zip(curve["shear_phalanges"], curve["normal_phalanges"], strict=True))

    @property
    def shear(self) -> Array:
        return self.values["shear"]

    @property
    def normal(self) -> Array:
        return self.values["normal"]

    @property
    def volume(self) -> Array:
        return self.values["volume"]

    @property
    def pressed_share(self) -> Array:
        return self.values["pressed_share"]

    def best(self, key: str) -> int:
        """Return at which of the tensions that hold a value is largest."""
        return int(np.where(self.holds, self.values[key], -np.inf).argmax())


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw the limits over the tension, dotted where closing alone fails."""
    data = result.data
    tension = np.array(data["tension"])
    figure = Figure(figsize=(12.0, 4.8), layout="constrained")
    for axes, force in zip(figure.subplots(1, 2), FORCES, strict=True):
        for curve, colour in zip(data["curves"], COLOURS, strict=True):
            values = np.array(curve[force], dtype=float)
            holds = np.array([state == "holds" for state in curve["state"]])
            name = f"{1e3 * curve['diameter']:g} mm"
            axes.plot(tension, values, ":", color=colour)
            axes.plot(tension, np.where(holds, values, np.nan), color=colour, label=name)
            fails = curve["closing_alone_fails_at"]
            if fails is not None:
                axes.axvline(fails, color=colour, alpha=0.4, linestyle="--")
                axes.annotate(
                    name,
                    (fails, 0.02),
                    xycoords=axes.get_xaxis_transform(),
                    xytext=(4.0, 0.0),
                    textcoords="offset points",
                    rotation=90.0,
                    color=colour,
                )
        axes.set(
            xlabel="tension of the tendons [N]; dashed: from there on closing alone fails",
            ylabel=f"{force} limit [N]",
            xlim=(0.0, tension[-1]),
            ylim=(0.0, None),
        )
        axes.grid(alpha=0.3)
        axes.legend(title="diameter")
    shear, normal = figure.axes
    shear.set_title(
        f"largest $F_x$ with $F_z \\leq 0$ at $F_x = "
        f"{data['force_to_moment']:g}\\,\\mathrm{{m^{{-1}}}}\\ M_y$"
    )
    normal.set_title("largest $-F_z$")
    figure.suptitle(data["surface"])
    return [save_picture(figure, folder / "fig15.png")]
