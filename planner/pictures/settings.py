"""Colours and sizes that several parts of the pictures have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["PICTURE_SETTINGS", "PictureSettings"]


@dataclass(frozen=True, slots=True)
class PictureSettings:
    """Colours as matplotlib names them, and sizes."""

    held: str = "tab:blue"
    gravity: str = "tab:red"
    asked: str = "black"
    """Colours of body wrenches and accelerations."""
    palm: str = "tab:brown"
    limb: str = "#4a6a8a"
    load: str = "tab:blue"
    longest_force: float = 32.0
    """Length of the arrow of the largest tile force [mm]."""
    note_padding: float = 1.0
    """Space around a note in a view [printer's points]."""
    rock_around: float = 0.45
    """Half the side of the box about a hand in which rock is drawn [m]."""
    rock_triangles: int = 3000
    """Triangles of a mesh near a hand above which it is drawn coarsely."""
    rock_coarseness: float = 0.02
    """Size of what is drawn of such a mesh [m]."""


PICTURE_SETTINGS: Final = PictureSettings()
