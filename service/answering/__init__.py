"""Request handlers of the service: decode and dispatch a request, encode its reply as bytes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
