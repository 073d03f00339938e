"""A stance in a browser on this machine: body and hands are dragged, and the plan follows."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
