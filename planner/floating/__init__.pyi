from .continuation import (
    LargestFactor as LargestFactor,
    least_use as least_use,
    most_load as most_load,
)
from .effort import (
    LeastEffort as LeastEffort,
    best_within as best_within,
    with_room as with_room,
)
from .goals import SETTINGS as SETTINGS, Goal as Goal
from .next_wrench import next_plan as next_plan
from .wrist_iteration import WristSolution as WristSolution, disagreements as disagreements
