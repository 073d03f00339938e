from .drawn_stance import (
    settled_as_drawn as settled_as_drawn,
    with_drawn_hands as with_drawn_hands,
)
from .hand_batch import (
    CONTACT_CODES as CONTACT_CODES,
    HandBatch as HandBatch,
    TileIndex as TileIndex,
    concatenated as concatenated,
    contact_pattern_of as contact_pattern_of,
    tile_index_of as tile_index_of,
)
from .hand_sets import (
    ExactMeasure as ExactMeasure,
    HandSets as HandSets,
    LinearisationPoint as LinearisationPoint,
    Sets as Sets,
    wrists_at as wrists_at,
)
from .joint_posture import (
    Posture as Posture,
    posture as posture,
    posture_at as posture_at,
    torque_limits as torque_limits,
)
from .prepared_stance import (
    PreparedStance as PreparedStance,
    assemble as assemble,
    checked_question as checked_question,
    prepare_stance as prepare_stance,
)
from .settled_stance import (
    come_to_rest as come_to_rest,
    floating_wrist as floating_wrist,
    hand_space as hand_space,
    resting_hand as resting_hand,
    settle_each as settle_each,
    settle_hand as settle_hand,
)
from .stance_constraints import (
    FORCE_CAP as FORCE_CAP,
    FORCE_DIRECTIONS as FORCE_DIRECTIONS,
    PASSIVE_JOINT as PASSIVE_JOINT,
    TENSION_CHANGE as TENSION_CHANGE,
    TOLERANCES as TOLERANCES,
    JointLoads as JointLoads,
    StanceConstraints as StanceConstraints,
)
