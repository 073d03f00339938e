from .fixed_wrists import FixedSolution as FixedSolution
from .objective import (
    CappedObjective as CappedObjective,
    MaxMargin as MaxMargin,
    Objective as Objective,
)
from .objectives import (
    NAMED_OBJECTIVES as NAMED_OBJECTIVES,
    objective_of as objective_of,
)
from .palm_parts import (
    PalmLoadFactors as PalmLoadFactors,
    load_factors_without_palm_loads as load_factors_without_palm_loads,
    plan_without_palms as plan_without_palms,
)
from .robust_tensions import MaxRobust as MaxRobust
from .solution import (
    Infeasible as Infeasible,
    Solution as Solution,
    Verified as Verified,
)
from .solve import (
    KnownStance as KnownStance,
    StanceAnswer as StanceAnswer,
    answer_on as answer_on,
    plan as plan,
    try_stance as try_stance,
    with_advice as with_advice,
)
from .unique_plan import (
    LeastUtilisation as LeastUtilisation,
    least_utilisation as least_utilisation,
)
from .verified import Checks as Checks, idle_joints as idle_joints
