from .body_wrench import WrenchCheck as WrenchCheck, wrench_findings as wrench_findings
from .distances import (
    body_clearance as body_clearance,
    clearance as clearance,
    link_findings as link_findings,
    unjoined_pairs as unjoined_pairs,
)
from .oddities import findings as findings
from .scene import (
    SCENE_SETTINGS as SCENE_SETTINGS,
    Scene as Scene,
    palm_capsule as palm_capsule,
    scene_of as scene_of,
    smooth_depths as smooth_depths,
)
from .units import unit_findings as unit_findings
