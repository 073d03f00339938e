from .finding import find_climb as find_climb
from .found_climb import (
    FoundClimb as FoundClimb,
    weakest_state as weakest_state,
    with_compliant_stages as with_compliant_stages,
    with_compliant_wrists as with_compliant_wrists,
)
from .move_checks import MoveChecks as MoveChecks
from .other_bodies import detours as detours
from .outcome import (
    ClimbProgress as ClimbProgress,
    ClimbStatus as ClimbStatus,
    DecidingStage as DecidingStage,
    Raise as Raise,
    RefusedMoves as RefusedMoves,
)
from .raising import raises as raises
from .routing import (
    ClimbStep as ClimbStep,
    RouteMaker as RouteMaker,
    refuse_limits as refuse_limits,
)
from .stepping import Stepping as Stepping
