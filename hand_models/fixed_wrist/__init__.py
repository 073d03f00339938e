"""A settled hand whose wrist stays: its rows by name, and its WrenchSpace."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
