"""The picture of a climb: bars, breaks, names and what is missing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from planner.pictures.report import draw_route
from planner.question import Limits, Question
from planner.route import RouteStage
from planner.solving import solve
from tests.suite.helpers.stances import on_wall


@cache
def answered():
    """A question, and its plan."""
    question = Question(on_wall(off=0.45, overhang=-0.3))
    return question, solve.plan(question)


def words(axes):
    return [note.get_text() for note in axes.texts]


@pytest.mark.parametrize(
    ("used", "crux"), [((0.4, 0.9, 0.3), 1), ((0.4, 1.6), 1), ((5.0, 0.3), 0), ((0.5, None), 1)]
)
def test_the_name_of_the_crux_is_inside_the_frame_and_beside_the_legend(used, crux):
    question, plan = answered()
    stages = [RouteStage(i, i, "lift", "front_left", question) for i in range(len(used))]
    plans = [replace(plan, utilisation=u, load_factor=None) for u in used]
    route = SimpleNamespace(name="up", limits=Limits())
    result = SimpleNamespace(plans=plans, stages=stages, route=route, crux=crux)
    figure = draw_route(result)
    FigureCanvasAgg(figure).draw()
    upper = figure.axes[0]
    note = next(text for text in upper.texts if text.get_text() == "crux")
    box = Text.get_window_extent(note)
    frame, legend = upper.get_window_extent(), upper.get_legend().get_window_extent()
    assert frame.y0 < box.y0 < box.y1 < frame.y1
    assert not box.overlaps(legend)
    assert legend.y0 >= frame.y1


def test_a_bar_that_is_cut_off_is_seen_to_be_broken_and_a_missing_load_factor_is_told():
    question, plan = answered()
    stages = [RouteStage(i, i, "lift", "front_left", question) for i in range(3)]
    stages.append(RouteStage(3, 3, "shift", None, question))
    plans = [
        replace(plan, utilisation=0.5, load_factor=2.0),
        replace(plan, utilisation=7.5, load_factor=None),
        replace(plan, utilisation=0.1, load_factor=None, load_factor_unbounded=True),
        replace(plan, utilisation=0.1, load_factor=None, load_factor_status="not_finished"),
    ]
    route = SimpleNamespace(name="up", limits=Limits())
    upper, lower = draw_route(SimpleNamespace(plans=plans, stages=stages, route=route, crux=1)).axes
    assert "7.5" in words(upper)
    (broken,) = (line for line in upper.lines if line.get_color() == "white")
    assert (min(broken.get_xdata()), max(broken.get_xdata())) == (0.5, 1.5)
    assert max(broken.get_ydata()) < upper.patches[1].get_height() < upper.get_ylim()[1]
    assert [text.get_text() for text in lower.get_xticklabels()][1:] == [
        "1 lift\nfront left",
        "2 lift\nfront left",
        "3 shift",
    ]
    assert [(text.get_text(), text.get_position()[0]) for text in lower.texts] == [
        ("none", 1),
        ("unbounded", 2),
        ("not finished", 3),
    ]


def test_of_many_stages_each_has_its_name_and_what_is_cut_off_is_told_whole():
    question, plan = answered()
    stages = [RouteStage(i, i, "lift", "front_right", question) for i in range(60)]
    plans = [replace(plan, utilisation=123.4, load_factor=None)] * 60
    route = SimpleNamespace(name="a $1 climb, $2 down", limits=Limits())
    figure = draw_route(SimpleNamespace(plans=plans, stages=stages, route=route, crux=1))
    FigureCanvasAgg(figure).draw()
    upper, lower = figure.axes
    names = [Text.get_window_extent(each) for each in lower.get_xticklabels() if each.get_text()]
    assert len(names) == 60
    assert all(one.x1 <= other.x0 for one, other in pairwise(names))
    told = [text for text in upper.texts if text.get_text() == "123"]
    assert len(told) == 60
    bars = [bar.get_window_extent() for bar in upper.patches[:60]]
    for text, bar in zip(told, bars, strict=True):
        box = Text.get_window_extent(text)
        assert bar.x0 <= box.x0 < box.x1 <= bar.x1
        assert bar.y0 <= box.y0 < box.y1 <= bar.y1
