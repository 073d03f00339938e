from .active_set import (
    TOLERANCES as TOLERANCES,
    ApartError as ApartError,
    Mask as Mask,
    Optimum as Optimum,
    Point as Point,
    Rows as Rows,
    optimum as optimum,
)
from .conic import (
    INFEASIBLE_STATUSES as INFEASIBLE_STATUSES,
    OUT_OF_TIME as OUT_OF_TIME,
    Columns as Columns,
    Outcome as Outcome,
    Reached as Reached,
)
from .dual_active_set import (
    dual_optimum as dual_optimum,
    load_dual_method as load_dual_method,
)
from .dual_bounds import (
    convex_bound as convex_bound,
    hazard_bound as hazard_bound,
    is_least as is_least,
    least_bound as least_bound,
    unique_bound as unique_bound,
    unproven_sentences as unproven_sentences,
)
from .hazard import Hazard as Hazard, TilePowers as TilePowers
from .program import (
    TIE_WEIGHT as TIE_WEIGHT,
    Elastic as Elastic,
    tie_weight as tie_weight,
)
from .robust import (
    Robust as Robust,
    SampleData as SampleData,
    feedback_price as feedback_price,
    sample_value as sample_value,
)
from .scaled_rows import (
    JOINT_FORCE as JOINT_FORCE,
    JOINT_TORQUE as JOINT_TORQUE,
    LOAD_BOX as LOAD_BOX,
    LOAD_UNIT as LOAD_UNIT,
    TWIST_UNIT as TWIST_UNIT,
    WRENCH_UNIT as WRENCH_UNIT,
    WRIST_RANGE as WRIST_RANGE,
    ScaledRows as ScaledRows,
    is_effort as is_effort,
    load_box as load_box,
)
from .set_points import (
    SET_POINT_SETTINGS as SET_POINT_SETTINGS,
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
    HandData as HandData,
    StanceData as StanceData,
    blocks_of as blocks_of,
    hands_data as hands_data,
    parted as parted,
)
from .supports import SilentHighs as SilentHighs, Support as Support
