"""Scans: point clouds and height grids read, and meshed to rock that a hand may hold."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
