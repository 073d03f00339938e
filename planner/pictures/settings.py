"""Colours and sizes that several pictures share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from hand_models.base import COLOUR_OF

__all__ = ["CENTRED_TEXT", "NOTE_STYLE", "PICTURE_SETTINGS", "PictureSettings"]


@dataclass(frozen=True, slots=True)
class PictureSettings:
    """Colours and sizes of pictures."""

    held: str = COLOUR_OF["blue"]
    gravity: str = COLOUR_OF["red"]
    asked: str = "black"
    """Colours of feasible sets (``held``), of gravity, and of what the question asks for."""
    palm: str = COLOUR_OF["purple"]
    limb: str = "#4a6a8a"
    load: str = COLOUR_OF["blue"]
    utilisation: tuple[str, ...] = ("#a2dfd2", "#d98330", "#ab1d30")
    overload: str = "#2b0d54"
    dark_overload: str = "#d9b3ff"
    """Colours of utilisations, evenly spaced from 0 to 1, and of those above 1:
    the more, the darker. ``dark_overload`` takes the place of the last on a dark page."""
    tie: float = 0.01
    """Part of the largest utilisation by which others that count as tied may be less: it is said
    with two digits, and no capacity is known better."""
    longest_force: float = 32.0
    """Length of the arrow of the largest tile force [mm]."""
    note_padding: float = 1.0
    """Space around a note in a view [printer's points]."""
    rock_around: float = 0.45
    """Half the side of the box around a hand in which rock is drawn [m]."""
    rock_triangles: int = 3000
    """Number of triangles near a hand above which a mesh is drawn coarsely."""
    rock_coarseness: float = 0.02
    """Grid size to which such a mesh is coarsened [m]."""
    wall_triangles: int = 30000
    """Number of triangles above which a whole rock is drawn coarsely on a page."""
    wall_cells: int = 100
    """Number of grid cells along such a rock, to which it is coarsened."""
    robot_triangles: int = 60000
    """Number of triangles of all meshes of a robot's links on a page, at most."""
    link_cell: float = 2e-3
    """Grid size from which on more are coarsened, half as much again each time [m]."""


PICTURE_SETTINGS: Final = PictureSettings()

CENTRED_TEXT: Final[dict[str, Any]] = {"ha": "center", "va": "center", "fontsize": 8}
"""Style of a text in the middle of a place."""

NOTE_STYLE: Final[dict[str, Any]] = CENTRED_TEXT | {
    "bbox": {
        "facecolor": "white",
        "edgecolor": "none",
        "alpha": 0.7,
        "pad": PICTURE_SETTINGS.note_padding,
    },
}
"""Style of a note beside what it names, on a light ground."""
