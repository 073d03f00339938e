"""One hand on one hold: what it can carry.

hold + hand parameters → settled finger (q, c) → tile loads as affine maps of tendon tension, or of
  the wrist's motion → WrenchSpace { o + V y : A y ≤ b } and its views.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
