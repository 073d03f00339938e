from .climb import (
    Move as Move,
    OutOfReach as OutOfReach,
    Route as Route,
    RouteResult as RouteResult,
    Stage as Stage,
    evaluate as evaluate,
)
