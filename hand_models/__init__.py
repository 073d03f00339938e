"""One hand on one hold: what it can carry.

hold + hand parameters → settled finger (q, c) → tile loads as affine maps of tendon tension, or of
  the wrist's motion → WrenchSpace { o + V y : A y ≤ b } and its views.
"""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load rooms that each ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
