"""Results: a plan and its hands, as arrays and one by one, recovered from loads."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
