from .distances import (
    body_clearance as body_clearance,
    clearance as clearance,
    link_findings as link_findings,
)
from .oddities import findings as findings
from .scene import Scene as Scene, scene_of as scene_of
from .units import unit_findings as unit_findings, wrench_findings as wrench_findings
