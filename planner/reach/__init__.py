"""Which placements a robot's hands reach from which poses of the body, with joint angles."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
