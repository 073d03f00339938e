from .equilibrium import Equilibria as Equilibria, LimbPull as LimbPull, equilibria as equilibria
from .margins import (
    KeptMargins as KeptMargins,
    kept_margins as kept_margins,
    margin_not_had as margin_not_had,
    without_margins as without_margins,
)
from .open_loop import (
    Passes as Passes,
    execute as execute,
    execute_closed as execute_closed,
    find_open_loop as find_open_loop,
)
from .set_points import sent_plans as sent_plans
