"""Scaled wrenches: moments over a length, so that all six components are newtons."""

from __future__ import annotations

from typing import Final

import numpy as np

__all__ = ["MOMENT_ARM", "SCALE"]

MOMENT_ARM: Final = 0.1
"""Makes newton-metres commensurate with newtons: about the size of a hand [m]."""

SCALE: Final = np.array([1.0, 1.0, 1.0, *[1.0 / MOMENT_ARM] * 3])
"""From a wrench to a scaled wrench [N]."""
