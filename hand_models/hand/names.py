"""Names of a hand's fingers and nails, of their limits, and of what of a tile touches the rock."""

from __future__ import annotations

from typing import Final

from hand_models.finger import KINDS

__all__ = ["CLOSURES", "CONTACTS", "FINGERS", "FINGERTIP_FORCE", "NAIL", "NAIL_SHEAR"]

FINGERS: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Order of every list of four tensions; left is +y of H."""

NAIL: Final = "nail"
"""The ultrashort phalanx at a fingertip, by name, and the contact of one that hooks."""

NAIL_SHEAR: Final = "nail_shear"
"""Name of the limit of a nail that pulls toward its finger's base."""

FINGERTIP_FORCE: Final = "fingertip_force"
"""Name of the limit of a distal phalanx, or a nail, that presses into the rock."""

CLOSURES: Final = ("laid", "hooked", "wedged", "curled", "stopped", "straight")
"""How a finger has ended: with all of its tiles on the rock, with some of them, with bare phalanges
or its tip only, in the air between its springs and its tendon, there with all joints at limits, or
held straight to cling with its nail."""

CONTACTS: Final = (*KINDS, NAIL)
"""Part of a tile that touches the rock, by code."""
