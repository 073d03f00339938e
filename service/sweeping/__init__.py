"""Plan while fields of a request vary: points, answers, table, border, pictures.

request, variations → Design (points, and the question at each) → rows → Sweep
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
