from .contact_rest import (
    CONTACT_SETTINGS as CONTACT_SETTINGS,
    ContactSettings as ContactSettings,
    closed_wrench as closed_wrench,
    contact_slopes as contact_slopes,
    placed_by_contact as placed_by_contact,
    rests_on_rock as rests_on_rock,
)
from .finger_twist import FINGER_TWIST as FINGER_TWIST, twist_arms as twist_arms
from .hold_trials import (
    AT_BORDER as AT_BORDER,
    AT_HOLE as AT_HOLE,
    HOLD_RANKS as HOLD_RANKS,
    REFUSAL_WORDS as REFUSAL_WORDS,
    FoundHold as FoundHold,
    HoldRank as HoldRank,
    HoldTrial as HoldTrial,
    closed_holds as closed_holds,
    ranked_holds as ranked_holds,
    try_holds as try_holds,
)
from .kept_hands import (
    ClosedPlacement as ClosedPlacement,
    check_made_with as check_made_with,
    input_digests as input_digests,
    read_hands as read_hands,
    write_hands as write_hands,
)
from .placing import (
    ALONG_FINGERS as ALONG_FINGERS,
    SEAT_RULES as SEAT_RULES,
    SeatRule as SeatRule,
    approach_frame as approach_frame,
    place as place,
)
from .pure_forces import (
    FORCE_TOLERANCE as FORCE_TOLERANCE,
    TRIAL_WAYS as TRIAL_WAYS,
    force_directions as force_directions,
    impossible_forces as impossible_forces,
    pure_reaches as pure_reaches,
)
from .row_layout import (
    HAND_LOAD as HAND_LOAD,
    PALM_PRESSING as PALM_PRESSING,
    PALM_SHEAR as PALM_SHEAR,
    TENDON_TENSION as TENDON_TENSION,
    RowLayout as RowLayout,
    layout_of as layout_of,
    named_row as named_row,
)
from .seat_scatter import (
    SCATTER_SETTINGS as SCATTER_SETTINGS,
    Robustness as Robustness,
    ScatterSettings as ScatterSettings,
    closed_about as closed_about,
    robustness as robustness,
    scattered_places as scattered_places,
)
from .seat_search import PULL_OFF as PULL_OFF, best_seats as best_seats
from .slipped_tiles import SLIPPED_TILE as SLIPPED_TILE, slipped_hand as slipped_hand
from .space import wrench_space as wrench_space, wrench_spaces as wrench_spaces
from .tension_box import TensionLimit as TensionLimit, tension_limits as tension_limits
from .trial_grids import grid_of_trials as grid_of_trials, trials_at as trials_at
