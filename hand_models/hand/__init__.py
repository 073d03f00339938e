"""Four fingers and a palm on a hold: numbers at the bottom, seating and settling at the top."""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load modules that ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
