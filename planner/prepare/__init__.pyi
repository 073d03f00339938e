from .assembly import gather as gather
from .hand_batch import (
    CONTACTS as CONTACTS,
    KEPT as KEPT,
    KEPT_NAMES as KEPT_NAMES,
    NONE as NONE,
    NOTHING as NOTHING,
    TOUCHING as TOUCHING,
    Places as Places,
    Same as Same,
    Stacked as Stacked,
    joined as joined,
    places_of as places_of,
    stacked as stacked,
    touch_of as touch_of,
)
from .hand_sets import (
    Hands as Hands,
    Measure as Measure,
    Point as Point,
    Sets as Sets,
    widest_at_rest as widest_at_rest,
)
from .joint_posture import (
    Posture as Posture,
    posture as posture,
    posture_at as posture_at,
    torque_limits as torque_limits,
)
from .settled_stance import (
    floating_wrist as floating_wrist,
    hand_space as hand_space,
    resting_hand as resting_hand,
    settle as settle,
)
from .stance_constraints import (
    BALL as BALL,
    FORCE_CAP as FORCE_CAP,
    TENSION_CHANGE as TENSION_CHANGE,
)
