"""Pages for a browser: plans and climbs in three dimensions, each page one file."""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load modules that ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
