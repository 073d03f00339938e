from .climb import (
    Move as Move,
    OutOfReach as OutOfReach,
    Route as Route,
    RouteResult as RouteResult,
    RouteStage as RouteStage,
    stages as stages,
)
from .climbing import plan_climb as plan_climb
from .evaluation import evaluate as evaluate
from .first_checks import refuse as refuse
from .knots import (
    Climb as Climb,
    Failure as Failure,
    Knot as Knot,
    KnotPhase as KnotPhase,
)
from .moving import closing_loads as closing_loads
from .moving_hand import HandKnot as HandKnot
from .settings import ClimbSettings as ClimbSettings
from .survival import (
    RouteShare as RouteShare,
    RouteSurvival as RouteSurvival,
    StageSurvival as StageSurvival,
    find_route_survival as find_route_survival,
)
