"""Still pictures: how their files are written, and the colours of what they compare."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from hand_models.base.files import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COLOUR_OF", "SERIES_COLOURS", "draw_arrow", "panel_grid", "write_picture"]

COLOUR_OF: Final = {
    "blue": "#11366f",
    "purple": "#8548a6",
    "red": "#d64a1a",
    "green": "#1fa583",
    "sky": "#86c5f2",
    "amber": "#fbd95c",
}
"""Colours of pictures, from dark to light.

Each two differ for the colour-blind, too, and as greys where a page is printed or copied without
colours (``tests/hand_models/base/test_pictures.py`` says by how much).
"""

SERIES_COLOURS: Final = tuple(
    COLOUR_OF[name] for name in ("blue", "red", "green", "sky", "purple", "amber")
)
"""Colours of curves beside each other, the first of them the farthest apart."""


def panel_grid(
    count: int, columns: int, size: tuple[float, float], **options: Any
) -> tuple[Figure, list[Any]]:
    """Return a figure with a number of axes in rows; the last row may have fewer.

    Parameters
    ----------
    count, columns : int
        Numbers of axes, and of axes in a row.
    size : tuple of float
        Width and height of the figure [inches].
    **options
        Of matplotlib's ``Figure.subplots``.

    Returns
    -------
    tuple of (Figure, list of Axes)
        The axes row by row.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(-(-count // columns), columns, squeeze=False, **options).ravel()
    for axes in panels[count:]:
        axes.remove()
    return figure, panels[:count].tolist()


def draw_arrow(axes: Any, start: Any, tip: Any, colour: Any, **style: Any) -> None:
    """Draw an arrow from a point to another, as a note without text.

    Parameters
    ----------
    axes : Axes
        Axes to draw into; their limits do not change.
    start, tip : array_like, shape (2,)
        Ends of the arrow, in the coordinates of the axes.
    colour : colour of matplotlib
    **style
        Of matplotlib's ``FancyArrowPatch``.
    """
    ends = {"shrinkA": 0.0, "shrinkB": 0.0} | style
    axes.annotate(
        "", tuple(tip), tuple(start), arrowprops={"arrowstyle": "-|>", "color": colour, **ends}
    )


def write_picture(figure: Figure, path: Path, dpi: float = 150.0, **options: Any) -> None:
    """Write a figure to a file, whole or not at all.

    Parameters
    ----------
    figure : Figure
    path : Path
        Its suffix, PNG, PDF or SVG, is the format.
    dpi : float, optional
        Pixels in an inch of PNG.
    **options
        Of matplotlib's ``savefig``.

    Raises
    ------
    OSError
        If writing fails; the error names ``path``.
    """
    from matplotlib import rc_context

    # fonts embedded as TrueType, which journals ask for; text that can be searched and edited
    with whole_file(path) as part, rc_context({"pdf.fonttype": 42, "svg.fonttype": "none"}):
        kind = path.suffix[1:].lower()
        figure.savefig(part, format=kind, dpi=dpi, facecolor="white", **options)
