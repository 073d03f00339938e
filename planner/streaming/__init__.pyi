from .stream import WrenchStream as WrenchStream
