"""SpinyHand: its model, seating and closing on holds; four fingers and a palm on the rock."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
