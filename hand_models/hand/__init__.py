"""Four fingers and a palm on a hold: numbers at the bottom, seating and settling at the top."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
