from .force_limits import (
    HullPoints as HullPoints,
    Limit as Limit,
    Measure as Measure,
    closing_limit as closing_limit,
    gripper_limits as gripper_limits,
    limit as limit,
    rest_state as rest_state,
    sharpened as sharpened,
)
from .gripper_fit import (
    FIT_TOLERANCES as FIT_TOLERANCES,
    FITTED_FIGURES as FITTED_FIGURES,
    READING_ERRORS as READING_ERRORS,
    Datum as Datum,
    GripperFit as GripperFit,
    ReadingErrors as ReadingErrors,
)
from .hard_stop import PalmExperiment as PalmExperiment
from .linear_sets import (
    asymmetry as asymmetry,
    even_directions as even_directions,
    linear_pieces as linear_pieces,
    linearised as linearised,
    spread as spread,
)
from .pictures import (
    PHALANX_COLOURS as PHALANX_COLOURS,
    conditions_title as conditions_title,
    draw_map as draw_map,
    draw_solid as draw_solid,
    label_solid as label_solid,
    legend as legend,
    panels as panels,
)
from .posterior import (
    POSTERIOR_SETTINGS as POSTERIOR_SETTINGS,
    Posterior as Posterior,
    PosteriorSettings as PosteriorSettings,
    Sampled as Sampled,
    as_draws as as_draws,
)
from .pulling import (
    Pulled as Pulled,
    balance_matrix as balance_matrix,
    even_pulls as even_pulls,
    explored as explored,
    held_wrenches as held_wrenches,
    pull as pull,
    pulled_off_poses as pulled_off_poses,
    unloaded as unloaded,
    wrist_poses as wrist_poses,
)
from .study_result import (
    Claim as Claim,
    Role as Role,
    StudyResult as StudyResult,
    StudyText as StudyText,
    listed as listed,
    part as part,
    track as track,
)
from .sweep import (
    GripperSweep as GripperSweep,
    radius_axes as radius_axes,
    sweep_cell as sweep_cell,
    sweep_map as sweep_map,
)
from .sweep_axis import Axis as Axis, Conditions as Conditions
from .wrench_hull import (
    PLANAR_SCALE as PLANAR_SCALE,
    Extents as Extents,
    best_moments as best_moments,
    clipped_vertices as clipped_vertices,
    distance_along as distance_along,
    edge as edge,
    extents as extents,
    in_paper_signs as in_paper_signs,
    loading_planes as loading_planes,
    pull_off_map as pull_off_map,
    reach_toward as reach_toward,
    section as section,
    strongest as strongest,
    vertices as vertices,
    volume as volume,
    with_mirrored as with_mirrored,
)
