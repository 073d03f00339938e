"""Rock in a finger's plane: where a face that turns first meets it, one face or many at once."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
