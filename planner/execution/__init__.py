"""Execution of a plan as it is: reactions to its tensions, equilibria on limbs and hands."""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load modules that ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
