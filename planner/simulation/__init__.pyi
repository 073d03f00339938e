from .cascade import (
    Cascade as Cascade,
    CascadeOutcome as CascadeOutcome,
    HandLoads as HandLoads,
    Loads as Loads,
    unit_names as unit_names,
)
