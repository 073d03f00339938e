"""Names of a hand's fingers and nails, of their limits, and of what of a tile touches the rock."""

from __future__ import annotations

from typing import Final

from hand_models.finger import CONTACT_KINDS

__all__ = ["CONTACT_NAMES", "FINGERS", "FINGERTIP_FORCE", "NAIL", "NAIL_SHEAR"]

FINGERS: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Order of every list of four tensions; left is +y of H."""

NAIL: Final = "nail"
"""The ultrashort phalanx at a fingertip, by name, and the contact of one that hooks."""

NAIL_SHEAR: Final = "nail_shear"
"""Name of the limit of a nail that pulls toward its finger's base."""

FINGERTIP_FORCE: Final = "fingertip_force"
"""Name of the limit of a distal phalanx, or a nail, that presses into the rock."""

CONTACT_NAMES: Final = (*CONTACT_KINDS, NAIL)
"""Part of a tile that touches the rock, by code."""
