"""How long an answer may still take: clock, budget of programs, work beside a solver."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
