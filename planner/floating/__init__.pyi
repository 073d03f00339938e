from .continuation import (
    NO_WRENCH as NO_WRENCH,
    PROGRAMS as PROGRAMS,
    LargestFactor as LargestFactor,
    least_use as least_use,
    most_load as most_load,
)
from .effort import least_effort as least_effort, with_room as with_room
from .wrist_iteration import WristSolution as WristSolution, disagreements as disagreements
