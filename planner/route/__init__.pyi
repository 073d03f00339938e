from .climb import (
    Move as Move,
    OutOfReach as OutOfReach,
    Route as Route,
    RouteResult as RouteResult,
    RouteStage as RouteStage,
)
from .evaluation import evaluate as evaluate
