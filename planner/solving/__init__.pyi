from .dual_bounds import is_least as is_least, least_bound as least_bound
from .objectives import (
    NAMED_OBJECTIVES as NAMED_OBJECTIVES,
    CappedObjective as CappedObjective,
    MaxMargin as MaxMargin,
    MaxRobust as MaxRobust,
    Objective as Objective,
    objective_of as objective_of,
)
from .palm_parts import (
    PalmLoadFactors as PalmLoadFactors,
    load_factors_without_palm_loads as load_factors_without_palm_loads,
)
from .solution import Infeasible as Infeasible, Verified as Verified
from .solve import (
    KnownStance as KnownStance,
    StanceAnswer as StanceAnswer,
    plan as plan,
    try_stance as try_stance,
    with_advice as with_advice,
)
from .unique_plan import least_utilisation as least_utilisation
