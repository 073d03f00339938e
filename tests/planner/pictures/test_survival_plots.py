"""The picture of simulated slips: a cascade of any length can be read."""

import itertools

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from planner.pictures import plot_survival, survival_plots
from planner.result import Slip, Survival, SurvivalShare

LIMBS = ("front_right", "rear_right", "rear_left", "front_left")
FINGERS = ("outer_left", "inner_left", "inner_right", "outer_right")


def survival(slips: int) -> Survival:
    names = list(itertools.product(LIMBS, FINGERS, ("proximal", "middle", "distal")))
    share = SurvivalShare.of(3, 10)
    return Survival(
        no_slip=0.3,
        strength_90=2.0,
        strength_99=5.0,
        holds=share,
        slipped=share,
        hold_scatter=0.0,
        rock_scatter=0.0,
        delay=0.0,
        seed=0,
        surfaces=[],
        cascade=[Slip(*name, 1.0 + i, 1.5 + i) for i, name in enumerate(names[:slips])],
        cascade_holds=False,
    )


@pytest.mark.parametrize(
    "slips", [24, 25, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 48))]
)
def test_the_names_of_a_cascade_stand_apart(slips, tmp_path, monkeypatch):
    figures: list[Figure] = []
    monkeypatch.setattr(survival_plots, "write_picture", lambda f, *_: figures.append(f))
    found = survival(slips)
    plot_survival(found, [(1.0, found)], tmp_path / "slips.png", "a stance")
    (figure,) = figures
    canvas = FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    labels = figure.axes[0].get_yticklabels()
    boxes = [label.get_window_extent(canvas.get_renderer()) for label in labels]
    assert all(upper.y0 >= lower.y1 for upper, lower in itertools.pairwise(boxes))
    bars = [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]
    said = [label.get_text() for label in labels if "more" not in label.get_text()]
    told = {" ".join((slip.limb, slip.finger or "", slip.phalanx)) for slip in found.cascade}
    assert set(said) <= told
    if slips <= 24:
        assert len(said) == len(labels) == slips
    else:
        assert [label.get_text() for label in labels][12] == f"… {slips - 23} more …"
        assert [bar.get_width() for bar in bars] == [*range(1, 13), *range(slips - 10, slips + 1)]
    # each diamond belongs to its bar
    (diamonds,) = [line for line in figure.axes[0].lines if line.get_marker() == "D"]
    places = [bar.get_y() + bar.get_height() / 2 for bar in bars]
    assert diamonds.get_ydata() == pytest.approx([place + 0.4 for place in places])
