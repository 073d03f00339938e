from .draws import (
    DrawnHand as DrawnHand,
    drawn_hands as drawn_hands,
    drawn_quantities as drawn_quantities,
)
from .limits import (
    BodyRange as BodyRange,
    ForceCap as ForceCap,
    LimbStiffness as LimbStiffness,
    Limits as Limits,
    Want as Want,
)
from .load import Load as Load, Weights as Weights
from .lost_tile import LostTile as LostTile
from .objectives import (
    MOVING_WRIST_OBJECTIVES as MOVING_WRIST_OBJECTIVES,
    Objective as Objective,
    objective_needs as objective_needs,
)
from .open_loop import OpenLoopSettings as OpenLoopSettings
from .question import (
    MOST_DRAWS as MOST_DRAWS,
    OwnObjective as OwnObjective,
    Question as Question,
)
from .stance import (
    EARTH_GRAVITY as EARTH_GRAVITY,
    HandOnHold as HandOnHold,
    Stance as Stance,
    checked_body_wrench as checked_body_wrench,
    known_limbs as known_limbs,
)
from .survival import SurvivalSettings as SurvivalSettings
