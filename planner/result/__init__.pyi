from .floating_load_recovery import recover_floating_hand as recover_floating_hand
from .hand_plan import HandPlan as HandPlan, WristPlan as WristPlan
from .load_recovery import LoadRecovery as LoadRecovery
from .plan import (
    Certificate as Certificate,
    LimitName as LimitName,
    Plan as Plan,
    Price as Price,
    RobustLoadFactor as RobustLoadFactor,
    SolverInfo as SolverInfo,
    Status as Status,
    TensionPath as TensionPath,
    Times as Times,
)
from .plan_arrays import PlanArrays as PlanArrays
from .set_points import (
    SetPoints as SetPoints,
    SetPointSource as SetPointSource,
    no_set_points as no_set_points,
)
