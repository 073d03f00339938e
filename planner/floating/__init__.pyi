from .continuation import NO_WRENCH as NO_WRENCH
from .continuation import PROGRAMS as PROGRAMS
from .continuation import LargestFactor as LargestFactor
from .continuation import least_use as least_use
from .continuation import most_load as most_load
from .effort import least_effort as least_effort
from .effort import with_room as with_room
from .wrist_iteration import Settled as Settled
