from .distances import (
    body_clearance as body_clearance,
    clearance as clearance,
    link_findings as link_findings,
)
from .oddities import findings as findings
from .scene import Scene as Scene, scene_of as scene_of
