from .cascade import (
    Cascade as Cascade,
    CascadeOutcome as CascadeOutcome,
    Loads as Loads,
    StateLoads as StateLoads,
    unit_names as unit_names,
)
from .plan_strengths import hand_of_units as hand_of_units, plan_loads as plan_loads
from .survival import (
    Draws as Draws,
    draw_slips as draw_slips,
    find_survival as find_survival,
)
