"""Bulk work: answer any number of plan requests in this process, in local processes, or on Dask.

Requests are grouped into chunks of bytes; a pool of workers answers the chunks with `answer_chunk`;
answers come back in the order of the requests, and are written as lines of JSON or as a table.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
