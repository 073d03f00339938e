from .hand_path import (
    HandPath as HandPath,
    Jam as Jam,
    TileEvent as TileEvent,
    closing_path as closing_path,
    opening_path as opening_path,
)
from .retreat import clear_retreat as clear_retreat
