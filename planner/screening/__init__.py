"""Screen stances: upper bounds of load factors from supports of hands, and the exact best ones."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
