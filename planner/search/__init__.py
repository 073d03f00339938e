"""Search a wall for the climb with the largest least load factor, with a bound of every other."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
