from .active_limits import (
    TOLERANCES as TOLERANCES,
    ActiveLimits as ActiveLimits,
    LimitUse as LimitUse,
    joint_name as joint_name,
    limit_name as limit_name,
    limit_unit as limit_unit,
    most_used as most_used,
)
from .certificate import (
    certify as certify,
    certify_idle as certify_idle,
)
from .moved_hands import changed_contacts as changed_contacts
from .path_safety import (
    tension_path as tension_path,
    unsafe_sentence as unsafe_sentence,
)
from .sentences import (
    constraint_words as constraint_words,
    limit_sentence as limit_sentence,
    overload_sentence as overload_sentence,
    part_words as part_words,
    shortfall_sentence as shortfall_sentence,
)
from .stance_warnings import (
    far_wrists as far_wrists,
    idle_preloads as idle_preloads,
    oddities as oddities,
    scene_findings as scene_findings,
    strained_preloads as strained_preloads,
    warnings as warnings,
)
from .wrist_findings import (
    ONE_OF_A_PLAN as ONE_OF_A_PLAN,
    palm_findings as palm_findings,
    stretch_findings as stretch_findings,
)
