"""Find climbs that can be executed: the search's states as a route, its moves planned whole."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
