"""The conic programs: the rows of a stance, CVXPY's definition, solvers kept ready."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
