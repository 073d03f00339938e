"""How a closed hand opens, and how an open hand closes: wrenches on the way, as few knots."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
