"""Paths of a hand that opens or closes: its wrench on the way, as few knots; its retreat."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
