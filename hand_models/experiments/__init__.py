"""What the paper's experiments do: pulls, hulls, force limits, sweeps of parameters."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
