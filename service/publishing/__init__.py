"""Wrenches and set-points that are published on streams, at the service and at its clients."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
