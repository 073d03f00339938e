from .half_planes import (
    HalfPlane as HalfPlane,
    bounds_gap as bounds_gap,
    directional_strength as directional_strength,
    inner_half_planes as inner_half_planes,
    outer_half_planes as outer_half_planes,
)
from .spine_array import SpineArray as SpineArray, statistics as statistics
from .spine_calibration import (
    LEAST_SPINES as LEAST_SPINES,
    LineFit as LineFit,
    fit_lateral as fit_lateral,
    fit_line as fit_line,
    measured_tile_shear as measured_tile_shear,
    within_law as within_law,
)
from .strength_scatter import (
    StrengthScatter as StrengthScatter,
    TileStrengths as TileStrengths,
    weibull_modulus as weibull_modulus,
)
from .surface import (
    LEAST_SHARE as LEAST_SHARE,
    Surface as Surface,
    engaged_share as engaged_share,
    preset_strengths as preset_strengths,
    pull_strength as pull_strength,
    surface_names as surface_names,
)
