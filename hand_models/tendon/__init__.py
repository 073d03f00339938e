"""One tendon, many tiles: load sharing with friction, stick and slip, the drive."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
