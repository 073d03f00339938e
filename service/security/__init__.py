"""Certificates of a robot's service and its clients, and what each of them may do on zenoh."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
