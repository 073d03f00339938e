"""Bulk work: any number of questions, answered in chunks, here, in processes or on a cluster.

questions → chunks of bytes → `answer_chunk`, wherever → answers in order → lines or a table
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
