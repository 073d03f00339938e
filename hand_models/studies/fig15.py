"""Fig. 15: force limits over the tension of the tendons, on 300 and 700 mm of fine concrete.

The shear limit is the largest F_x of the wrench hull with F_z ≤ 0 in the loading plane
F_x = 50 M_y; the pure shear limit, beside it, has F_z = 0 on the same line. The normal limit is the
largest −F_z of the hull. It lies in that plane, too: the hull is skew symmetric, so for every
wrench it has one without F_x and M_y of the same F_z.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import COLOUR_OF, Array, InvalidInputError, Progress
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import Conditions, StudyResult, StudyText
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
    table, settings = gripper_table(hand), experiment_table()
    (least, most), count = settings.vector("fig15", "tensions"), STUDY_SETTINGS.fig15_tensions
    tried = np.linspace(least, most, count)
    diameters = settings.vector("parameter_studies", "diameters")
    curves = []
    for done, diameter in enumerate(diameters):
        steps = count * done, count * (done + 1), count * len(diameters)
        curves.append(_curve(table, diameter, tried, experiments.part(progress, *steps)))
    data: dict[str, Any] = {
        "surface": Conditions.surface,
        "force_to_moment": settings.scalar("parameter_studies", "force_to_moment"),
        "tension": tried,
        "curves": curves,
    }
    return _checked(data, *curves)


def _curve(table: ParameterTable, diameter: float, tried: Array, progress: Progress) -> _Curve:
    """Return the limits on a surface at each tension; none where nothing holds."""

    def gripper(tension: float) -> Gripper:
        return Conditions(diameter, tension).gripper(table)

    settings = STUDY_SETTINGS
    effort = settings.fig15_rays, settings.fig15_cuts, settings.fig15_starts
    tensions = experiments.track(progress, tried.tolist())
    rows = [experiments.gripper_limits(gripper(tension), *effort) for tension in tensions]
    values = ("shear", "pure_shear", "normal", "volume", "pressed_share")
    failing = ("shear_phalanges", "normal_phalanges")
    curve = {
        "diameter": diameter,
        "state": [row["state"] for row in rows],
        **{key: np.array([row.get(key, np.nan) for row in rows]) for key in values},
        **{key: [row.get(key, []) for row in rows] for key in failing},
        "closing_alone_fails_at": experiments.closing_limit(gripper, tried),
    }
    return _Curve(curve)


def _checked(data: dict[str, Any], strong: _Curve, weak: _Curve) -> StudyResult:
    """Hold the sentences of Section 7.1 against the curves, as far as closing alone holds."""
    text, tried = StudyText("fig15"), data["tension"]
    # share of a limit by which it may wander where it is said to fall: a local search finds hulls
    slack = 0.02
    both = strong.holds & weak.holds
    if not both.any():
        raise InvalidInputError(
            f"exceeds a limit at every closing tension from {tried[0]:g} to {tried[-1]:g} N, on a "
            f"surface of {strong.name} or on one of {weak.name}: take a stronger hand",
            field="hand",
        )
    for curve in (strong, weak):
        best, half, last = curve.best("volume"), curve.last // 2, curve.last
        widened = curve["volume"][half] / curve["volume"][0]
        ends = {"where": curve.name, "least": tried[0], "most": tried[last]}
        text.check("moderate", widened > 1.0, widened=widened, half=tried[half], **ends)
        text.check("not_large", 0 < best < last, best=tried[best], **ends)
    best, last = weak.best("shear"), weak.last
    at_best, at_most = weak["normal"][best], weak["normal"][last]
    found = {"at_best": at_best, "best": tried[best], "at_most": at_most, "most": tried[last]}
    text.check("normal_on_flat", at_most > at_best, where=weak.name, **found)
    for curve in (weak, strong):
        best, last = curve.best("shear"), curve.last
        after = curve["shear"][best : last + 1]
        falls = bool((np.diff(after) <= slack * after[0]).all())
        found = {"first": after[0], "best": tried[best], "last": after[-1], "most": tried[last]}
        holds = len(after) > 1 and falls and after[-1] < (1.0 - slack) * after[0]
        steadily = "" if falls else "; not steadily"
        text.check("reduces_shear", holds, where=curve.name, steadily=steadily, **found)
    names = {"strong": strong.name, "weak": weak.name}
    for force in ("shear", "normal"):
        high, low = strong[force][both], weak[force][both]
        ratios, own, other = low / high, np.ptp(low), np.ptp(high)
        ends = {"least": ratios.min(), "most": ratios.max()}
        text.check("lower", (low < high).all(), force=force, **ends, **names)
        text.check("less_sensitive", own < other, force=force, own=own, other=other, **names)
    curved, flat = (float(np.mean(curve["pressed_share"][both])) for curve in (strong, weak))
    text.check("normal_share", curved > flat, curved=curved, flat=flat, **names)
    steps = range(strong.best("shear"), strong.last + 1)
    beyond = [strong[f"{force}_phalanges"][i] for i in steps for force in ("shear", "normal")]
    others = ", ".join(sorted(set().union(*beyond) - {"proximal", "distal"})) or "nobody"
    ends_fail = sum("proximal" in found or "distal" in found for found in beyond)
    shares = {"ends": ends_fail, "of": len(beyond), "others": others}
    text.check("ends_fail", 2 * ends_fail > len(beyond), where=strong.name, **shares)
    return text.result(data)


class _Curve(dict[str, Any]):
    """The limits on a surface, and where closing alone holds."""

    def __init__(self, curve: dict[str, Any]) -> None:
        super().__init__(curve)
        self.name = f"{1e3 * curve['diameter']:g} mm"
        self.holds = (np.array(curve["state"]) == "holds") & np.isfinite(curve["shear"])
        self.last = int(np.flatnonzero(self.holds)[-1]) if self.holds.any() else 0

    def best(self, key: str) -> int:
        """Return at which of the tensions that hold a value is largest."""
        return int(np.where(self.holds, self[key], -np.inf).argmax())


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the shear and normal limits over the tension, dotted where closing alone fails."""
    data, tension, text = result.data, result.data["tension"], StudyText("fig15")
    figure, both = experiments.panels(1, 2, (12.0, 4.8))
    colours = COLOUR_OF["blue"], COLOUR_OF["red"]
    for axes, force in zip(both, ("shear", "normal"), strict=True):
        for curve, colour in zip(map(_Curve, data["curves"]), colours, strict=True):
            fails = curve["closing_alone_fails_at"]
            held = np.where(np.array(curve["state"]) == "holds", curve[force], np.nan)
            axes.plot(tension, curve[force], ":", color=colour)
            axes.plot(tension, held, color=colour, label=curve.name)
            if fails is not None:
                axes.axvline(fails, color=colour, alpha=0.4, linestyle="--")
                place: Any = {"xycoords": axes.get_xaxis_transform(), "rotation": 90.0}
                place |= {"textcoords": "offset points", "color": colour}
                axes.annotate(curve.name, (fails, 0.02), (4.0, 0.0), **place)
        axes.set(xlim=(0.0, tension[-1]), ylim=(0.0, None))
        text.label(axes, force, ratio=data["force_to_moment"])
    figure.suptitle(data["surface"])
    return {"fig15": figure}
