"""The picture of scanned rock."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hand_models.base import Pose
from hand_models.rock import Triangles
from hand_models.scans import Hole, ScannedRock, pictures, plot_holds, plot_rock
from hand_models.scans.compiled_pictures import seen_triangles


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures that are drawn."""
    figures: list[Figure] = []

    def kept(*args: object, **kwargs: object) -> Figure:
        figures.append(Figure(*args, **kwargs))  # type: ignore[arg-type]
        return figures[-1]

    monkeypatch.setattr(pictures, "Figure", kept)
    return figures


def test_points_without_a_hold_have_a_marker_for_each_kind(
    tmp_path: Path, made: list[Figure]
) -> None:
    corners = np.array([(x, y, 0.01 * x) for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    rock = Triangles(corners, np.array([(0, 1, 2), (1, 3, 2)]))
    kinds = {
        "rock is inside the palm (2)": np.array([(0.1, 0.2, 0.0), (0.3, 0.4, 0.0)]),
        "the scan ends, or has a hole, within a finger's reach (1)": np.array([(0.9, -0.8, 0.0)]),
    }
    held = np.array([(0.0, 0.0, 0.0)])
    plot_holds(rock, held, np.array([50.0]), kinds, [], tmp_path / "holds.png", "holds", "share")
    (figure,) = made
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert [text.get_text() for text in legend.get_texts()] == list(kinds)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    for kind, points in kinds.items():
        # y of the rock's frame to the right, x up
        np.testing.assert_array_equal(lines[kind].get_xydata(), points[:, [1, 0]])
    assert len({line.get_marker() for line in lines.values()}) == len(kinds)
    assert [axes.get_ylabel() for axes in figure.axes][1] == "share"


def test_in_each_pixel_the_first_triangle_is_seen() -> None:
    """Against the depth of every triangle's plane at every pixel."""
    triangles = np.random.default_rng(0).uniform(-3.0, 23.0, (12, 3, 3))
    rows, columns = 20, 17
    middles = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
    depths = np.full((len(triangles), rows, columns), np.inf)
    for depth, triangle in zip(depths, triangles, strict=True):
        plane = np.column_stack([triangle[:, :2], np.ones(3)])
        weights = np.insert(middles, 2, 1, axis=-1) @ np.linalg.inv(plane)
        inside = (weights >= 0.0).all(axis=-1)
        depth[inside] = (weights @ triangle[:, 2])[inside]
    want = np.where(np.isfinite(depths.min(axis=0)), depths.argmin(axis=0), -1)
    assert (want < 0).any()
    np.testing.assert_array_equal(seen_triangles(triangles, rows, columns), want)


def test_widths_of_holes_do_not_lie_on_each_other_nor_the_legend_on_the_rock(
    tmp_path: Path, made: list[Figure]
) -> None:
    corners = np.array([(x, y, 0.01 * x) for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    places = np.random.default_rng(0).uniform(-0.3, 0.3, (12, 3))
    holes = tuple(Hole(0.2 - 0.01 * i, place) for i, place in enumerate(places))
    faces = np.array([(0, 1, 2), (1, 3, 2)])
    rock = ScannedRock(corners, faces, Pose(np.zeros(3), np.eye(3)), holes, 4, 0, 0.1)
    plot_rock(rock, tmp_path / "rock.png")
    (figure,) = made
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    assert axes.texts[0].get_text() == "200 mm"
    assert 3 < len(axes.texts) < len(holes)
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    (legend,) = figure.legends
    assert legend.get_window_extent().y1 <= axes.get_window_extent().y0
