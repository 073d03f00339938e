"""Names of fingers, nails and contact states, and of the limits of nails and fingertips."""

from __future__ import annotations

from typing import Final

from hand_models.finger import CONTACT_KINDS

__all__ = ["CONTACT_NAMES", "FINGERS", "FINGERTIP_FORCE", "NAIL", "NAIL_SHEAR"]

FINGERS: Final = ("outer_left", "inner_left", "inner_right", "outer_right")
"""Names of the fingers, in the order of every list of four tensions; left is +y of H."""

NAIL: Final = "nail"
"""Name of the nail among the phalanges, and contact state of a nail that hooks."""

NAIL_SHEAR: Final = "nail_shear"
"""Name of the limit of a nail that pulls toward its finger's base."""

FINGERTIP_FORCE: Final = "fingertip_force"
"""Name of the limit of a distal phalanx, or a nail, that presses into the rock."""

CONTACT_NAMES: Final = (*CONTACT_KINDS, NAIL)
"""Contact states of a tile or nail by integer code."""
