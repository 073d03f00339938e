from .climb import (
    Move as Move,
    OutOfReach as OutOfReach,
    Route as Route,
    RouteResult as RouteResult,
    RouteStage as RouteStage,
)
from .evaluation import evaluate as evaluate
from .knots import (
    Climb as Climb,
    Failure as Failure,
    HandKnot as HandKnot,
    Knot as Knot,
)
from .survival import (
    RouteShare as RouteShare,
    RouteSurvival as RouteSurvival,
    StageSurvival as StageSurvival,
    find_route_survival as find_route_survival,
)
