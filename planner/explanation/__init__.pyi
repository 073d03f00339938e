from .active_limits import (
    ALIKE as ALIKE,
    BINDING as BINDING,
    ActiveLimits as ActiveLimits,
    LimitUse as LimitUse,
    joint_name as joint_name,
    limit_name as limit_name,
    limit_unit as limit_unit,
)
from .certificate import (
    certify as certify,
    certify_idle as certify_idle,
)
from .path_safety import (
    UNKNOWN as UNKNOWN,
    tension_path as tension_path,
    unsafe_sentence as unsafe_sentence,
)
from .sentences import (
    LEAST_FACTOR as LEAST_FACTOR,
    NO_FACTOR as NO_FACTOR,
    UNPROVEN as UNPROVEN,
    constraint_words as constraint_words,
    limit_sentence as limit_sentence,
    overload_sentence as overload_sentence,
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
