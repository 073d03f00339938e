"""The picture of scanned rock."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hand_models.base import Pose
from hand_models.scans import Hole, ScannedRock, pictures, plot_rock


def test_widths_of_holes_do_not_lie_on_each_other_nor_the_legend_on_the_rock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Figure] = []

    def kept(*args: object, **kwargs: object) -> Figure:
        made.append(Figure(*args, **kwargs))  # type: ignore[arg-type]
        return made[-1]

    monkeypatch.setattr(pictures, "Figure", kept)
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
