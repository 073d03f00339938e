"""What one spine tile holds: limit surface, half-planes, the spine array and its fits."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
