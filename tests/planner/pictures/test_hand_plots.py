"""The picture of a hand on its hold, for every hold and any place of its fingers."""

from __future__ import annotations

import math
from itertools import combinations, product

import numpy as np
import pytest
from matplotlib.figure import Figure, SubFigure

from hand_models import Cylinder, Edge, Ellipsoid, Grasp, Plane, Sphere
from hand_models.compliance import CompliantHand, FloatingWrist
from hand_models.fixed_wrist import wrench_space
from hand_models.rock import Mesh, Profile
from planner.pictures import hand_plots
from planner.pictures.settings import PICTURE_SETTINGS
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import cylinder_mesh

HOLDS = {
    "plane": (Plane(), 0.0),
    "cylinder": (Cylinder(0.3), math.pi),
    "sphere": (Sphere(0.22), 1.0),
    "ellipsoid": (Ellipsoid((0.2, 0.15, 0.1)), 2.5),
    "edge": (Edge(0.05, 1.5), 0.4),
    "profile": (Profile([[-0.2, 0.1], [0.0, 0.0], [0.2, 0.1]]), math.pi),
    "mesh": (Mesh(*cylinder_mesh(0.2, 64)), 1.0),
    "too small to hold": (Sphere(0.02), 0.0),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hold", "rotation"),
    [pytest.param(*own, id=name) for name, own in HOLDS.items()],
)
def test_every_hold_has_a_picture(hold, rotation, tmp_path):
    settled = HAND.settle(hold, ROCK, Grasp(rotation, lateral=False))
    path = tmp_path / "hand.png"
    hand_plots.plot_wrench_space(settled, wrench_space(settled), path, "a hand")
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "name",
    [
        "cylinder",
        pytest.param("too small to hold", marks=pytest.mark.slow),
        pytest.param("ellipsoid", marks=pytest.mark.slow),
        pytest.param("mesh", marks=pytest.mark.slow),
    ],
)
def test_titles_and_labels_lie_on_nothing_else_that_is_written(name):
    hold, rotation = HOLDS[name]
    settled = HAND.settle(hold, ROCK, Grasp(rotation, lateral=False))
    figure = hand_plots.draw_wrench_space(settled, wrench_space(settled), "a hand")
    figure.draw_without_rendering()
    titles = [text for part in figure.findobj(SubFigure) for text in part.texts]
    ticks = []
    for axes in figure.axes:
        titles += [axes.title, axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            labels = zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True)
            ticks += [label for place, label in labels if low <= place <= high]
    titles, ticks = ([text for text in texts if text.get_text()] for texts in (titles, ticks))
    assert len(titles) >= 3 * 8
    assert len(ticks) > 50
    clashes = [
        (one.get_text(), other.get_text())
        for one, other in (*combinations(titles, 2), *product(titles, ticks))
        if one.get_window_extent().overlaps(other.get_window_extent())
    ]
    assert clashes == []


def test_contacts_and_forces_are_drawn_where_they_are():
    settled = HAND.settle(Cylinder(0.3), ROCK, Grasp(math.pi))
    axes = Figure().subplots(2, 2).ravel()
    hand_plots.draw_fingers(list(axes), settled, np.full(4, settled.closing_tension))
    drawn = axes[0]  # inner_left
    finger = settled.fingers[1]
    dots = [line for line in drawn.lines if line.get_color() == "black"]
    np.testing.assert_allclose(
        np.array([dot.get_xydata()[0] for dot in dots]), 1e3 * finger.points, atol=1e-9
    )
    loads = settled.tile_loads(np.full(4, settled.closing_tension))
    largest = np.hypot(*loads[:, :2].T).max()
    rows = np.flatnonzero(settled.finger_of == 1)
    arrows = [note for note in drawn.texts if getattr(note, "arrow_patch", None) is not None]
    tips = [np.array(note.xy) - np.array(note.xyann) for note in arrows[: len(rows)]]
    for tip, row in zip(tips, rows, strict=True):
        force = loads[row, 0] * settled.axes[row, 0] + loads[row, 1] * settled.axes[row, 1]
        np.testing.assert_allclose(
            tip, PICTURE_SETTINGS.longest_force * force[[0, 2]] / largest, atol=1e-9
        )


def test_a_floating_hand_is_drawn_with_the_loads_of_its_preload_at_rest(monkeypatch):
    settled = HAND.settle(Cylinder(0.3), ROCK, Grasp(math.pi))
    wrist = FloatingWrist(CompliantHand(settled, [40.0, 50.0, 60.0, 45.0]))
    at_rest = wrist.hand.loads(np.zeros((1, 6)))
    drawn = settled.tile_loads(wrist.hand.preload)
    np.testing.assert_allclose(drawn[:, 0], at_rest.shears[0], atol=1e-9)
    np.testing.assert_allclose(drawn[:, 1], at_rest.normals[0], atol=1e-9)
    titles = []
    monkeypatch.setattr(SubFigure, "suptitle", lambda _, text, **how: titles.append(text))
    hand_plots.draw_wrench_space(settled, wrist.linearised(), "a hand", wrist.hand.preload)
    assert "preload of 40, 50, 60, 45 N, wrist floating" in titles[0]
    assert "linearised at rest" in titles[1]


@pytest.mark.parametrize(
    ("along", "words"),
    [
        ([1.0, 0.0, 0.0], "along x of H"),
        ([-1.0, 1e-9, 0.0], "along −x of H"),
        ([0.0, -1.0, 0.0], "along −y of H"),
        ([0.5, math.sqrt(0.75), 0.0], "60° from x toward y of H"),
    ],
)
def test_planes_are_named_by_their_direction(along, words):
    assert hand_plots.direction_in_words(np.array(along)) == words
