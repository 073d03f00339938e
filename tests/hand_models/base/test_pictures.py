"""Still pictures: colours that print and that the colour-blind tell apart, text that stays text."""

from __future__ import annotations

import re
import zlib
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, SERIES_COLOURS, write_picture
from planner.pictures.plan_views import UTILISATION_COLOURS
from planner.pictures.settings import PICTURE_SETTINGS

# how linear RGB is seen without red cones and without green ones: G. M. Machado, M. M. Oliveira,
# L. A. F. Fernandes, A Physiologically-based Model for Simulation of Color Vision Deficiency, 2009
EYES = {
    "all cones": np.eye(3),
    "no red cones": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "no green cones": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""CIE XYZ of linear sRGB."""

APART = 15.0
"""Least distance of two colours in CIELAB; 2 to 3 can just be told when they touch."""

GREYS = 7.0
"""Least difference of two colours' lightness in CIELAB, of 100 from black to white."""


def seen(colour, eye=EYES["all cones"]):
    """A colour in CIELAB, as an eye sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    x, y, z = XYZ @ np.clip(eye @ linear, 0.0, 1.0) / XYZ.sum(axis=1)
    f = [np.cbrt(t) if t > 216 / 24389 else (24389 / 27 * t + 16) / 116 for t in (x, y, z)]
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def distance(one, other, eye):
    return float(np.linalg.norm(seen(one, eye) - seen(other, eye)))


@pytest.mark.parametrize("eye", EYES)
def test_colours_are_told_apart(eye):
    for one, other in combinations(COLOUR_OF.values(), 2):
        assert distance(one, other, EYES[eye]) >= APART, (one, other)


def test_colours_are_told_apart_as_greys():
    for one, other in combinations(COLOUR_OF.values(), 2):
        assert abs(seen(one)[0] - seen(other)[0]) >= GREYS, (one, other)
    # of few curves, the first are more than twice as far apart
    for one, other in pairwise(sorted(seen(each)[0] for each in SERIES_COLOURS[:2])):
        assert other - one >= 2.0 * GREYS


@pytest.mark.parametrize("eye", EYES)
def test_utilisations_are_told_apart(eye):
    quarters = [UTILISATION_COLOURS(used) for used in (0.0, 0.25, 0.5, 0.75, 1.0)]
    for one, other in pairwise([*quarters, PICTURE_SETTINGS.overload]):
        assert distance(one, other, EYES[eye]) >= APART


def test_the_more_is_used_the_darker():
    used = np.linspace(0.0, 1.0, 41)
    lightness = [seen(UTILISATION_COLOURS(each))[0] for each in used]
    assert (np.diff(lightness) < 0.0).all()
    assert (-np.diff(lightness[::10]) >= GREYS).all()
    assert lightness[-1] - seen(PICTURE_SETTINGS.overload)[0] >= GREYS


def titled(words):
    figure = Figure(figsize=(2.0, 1.0))
    figure.text(0.1, 0.5, words)
    return figure


def test_text_stays_text(tmp_path):
    for name in ("a.pdf", "a.svg", "a.png"):
        write_picture(titled("utilisation"), tmp_path / name)
    assert ">utilisation</text>" in (tmp_path / "a.svg").read_text("utf-8")
    pdf = (tmp_path / "a.pdf").read_bytes()
    # the font is embedded, as TrueType, and no glyph is a procedure of its own
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL)
    unpacked = [zlib.decompress(each) for each in streams if each[:1] == b"x"]
    assert any(b" Tf" in each for each in unpacked)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_that_cannot_be_written_leaves_the_old_one(tmp_path):
    file = tmp_path / "a.png"
    file.write_bytes(b"old")
    with pytest.raises(ValueError, match="not supported"):
        write_picture(titled("a"), tmp_path / "a.nonsense")
    assert [each.name for each in tmp_path.iterdir()] == ["a.png"]
    assert file.read_bytes() == b"old"
