"""Operation of a service: options from a file, checks, supervision, monitor, results of replays."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
