from .conic import (
    INFEASIBLE_STATUSES as INFEASIBLE_STATUSES,
    Outcome as Outcome,
    Reached as Reached,
)
from .program import (
    LOAD_BOX as LOAD_BOX,
    TIE_WEIGHT as TIE_WEIGHT,
    Elastic as Elastic,
    tie_weight as tie_weight,
)
from .set_points import (
    Kept as Kept,
    LeastChange as LeastChange,
    kept as kept,
    least_change as least_change,
)
from .solvers import (
    CAP_SLACK as CAP_SLACK,
    TensionTrade as TensionTrade,
    beyond as beyond,
    body_wrench as body_wrench,
    curved as curved,
    effort as effort,
    elastic as elastic,
    least_tensions as least_tensions,
    less_tension as less_tension,
    load_factor as load_factor,
    loads_are_feasible as loads_are_feasible,
    margin as margin,
    nearest as nearest,
    nearest_body as nearest_body,
    reach as reach,
    tension_trade as tension_trade,
    tie_break as tie_break,
    unique as unique,
    used as used,
    used_effort as used_effort,
    vertex as vertex,
)
from .stance_data import (
    JOINT_FORCE as JOINT_FORCE,
    JOINT_TORQUE as JOINT_TORQUE,
    LOAD_UNIT as LOAD_UNIT,
    TWIST_UNIT as TWIST_UNIT,
    WRENCH_UNIT as WRENCH_UNIT,
    WRIST_RANGE as WRIST_RANGE,
    WRIST_TRAVEL as WRIST_TRAVEL,
    HandData as HandData,
    ScaledRows as ScaledRows,
    StanceData as StanceData,
    hands_data as hands_data,
    is_effort as is_effort,
    parted as parted,
)
from .supports import SilentHighs as SilentHighs, Support as Support
