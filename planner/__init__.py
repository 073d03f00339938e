"""Many hands, one body: who carries what.

stance + question → WrenchSpace of every hand → conic program → solution → verified Plan.
"""

import lazy_loader
import numpy.typing  # noqa: F401 - whole, before threads load rooms that each ask for parts of it

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
