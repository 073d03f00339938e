from .conic import PROVEN as PROVEN, UNBOUNDED as UNBOUNDED, Outcome as Outcome, Reached as Reached
from .program import TIE as TIE, UNLIMITED as UNLIMITED, tie_weight as tie_weight
from .solvers import (
    SLACK as SLACK,
    TensionTrade as TensionTrade,
    beyond as beyond,
    body_wrench as body_wrench,
    curved as curved,
    effort as effort,
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
    HandData as HandData,
    ScaledRows as ScaledRows,
    StanceData as StanceData,
    hands_data as hands_data,
    is_effort as is_effort,
    parted as parted,
)
from .stance_program import SOLVER as SOLVER
from .supports import SilentHighs as SilentHighs, Support as Support
