"""A question looked at as a scene: what is odd, and may not be meant, and what is near what."""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load modules that ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
