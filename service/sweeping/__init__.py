"""Sweeps: plan a stance while fields of the request vary, over a grid or random samples.

A `Design` builds a request for each point from the fields that vary; the answers become rows; a
`Sweep` has the rows, the table, the borders between feasible and infeasible, and the pictures.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
