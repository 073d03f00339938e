"""Wire format of messages: encodings, validation, errors, zenoh keys, and JSON Schema."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
