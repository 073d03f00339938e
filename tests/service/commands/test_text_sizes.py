"""Text of every picture can be read on a page."""

from __future__ import annotations

import shlex

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from service.commands.cli import run_command_line

pytestmark = pytest.mark.slow

PAGES = {"portrait": 180.0 / 25.4, "landscape": 277.0 / 25.4}
"""Width of what is printed on a page of A4, upright and turned [inch]."""

LEAST = 7.0
"""Size of the smallest text [printer's points]."""

PICTURES = {
    "body-space wall-300 --axes fx,fz --plot p.png": "portrait",
    "body-space slab --com --plot p.png": "portrait",
    "redundancy wall-300 --plot p.png": "portrait",
    "wrench-space wall-300 --hand front_left --opening --plot p.png": "portrait",
    "sweep wall-300 --vary load.mass=60:120:3 -o out": "portrait",
    "sweep wall-300 --vary load.mass=60:120:2 --vary gravity.2=-9:-3:2 -o out": "portrait",
    "study fig06 -o out": "landscape",
    "plan wall-300-joints --spread --plot p.png": "landscape",
    "plan boulders --plot p.png": "landscape",
    "wrench-space wall-300 --hand front_left --plot p.png": "landscape",
    "simulate slab --draws 5 --plot p.png": "landscape",
    "route six-moves -o out": "landscape",
}
"""Page that the picture of a command is for."""


@pytest.mark.parametrize("command", PICTURES)
def test_text_can_be_read_on_a_page(command, tmp_path, monkeypatch):
    found = []
    written = Figure.savefig

    def measured(figure, *args, **options):
        figure.draw_without_rendering()
        part = min(1.0, PAGES[PICTURES[command]] / figure.get_size_inches()[0])
        texts = [text for text in figure.findobj(Text) if text.get_visible()]
        found.extend((part * t.get_fontsize(), t.get_text()) for t in texts if t.get_text())
        return written(figure, *args, **options)

    monkeypatch.setattr(Figure, "savefig", measured)
    monkeypatch.chdir(tmp_path)
    assert run_command_line(shlex.split(command)) in (0, 3)
    assert len(found) > 10
    assert min(found) >= (LEAST,), min(found)
