from .oddities import findings as findings
from .scene import Scene as Scene, scene_of as scene_of
