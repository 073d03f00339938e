from .climb import Move as Move
from .climb import OutOfReach as OutOfReach
from .climb import Route as Route
from .climb import RouteResult as RouteResult
from .climb import Stage as Stage
from .climb import evaluate as evaluate
