from .draws import (
    FITTED_SURFACE as FITTED_SURFACE,
    OF_GRIPPER as OF_GRIPPER,
    ParameterSample as ParameterSample,
    bundled_draws as bundled_draws,
    draws_of as draws_of,
    own_draw as own_draw,
)
from .own import (
    LARGEST_BY_UNIT as LARGEST_BY_UNIT,
    check_widths as check_widths,
    load_own_hand as load_own_hand,
    own_hand as own_hand,
    own_surfaces as own_surfaces,
)
from .quantiles import even_quantiles as even_quantiles
from .tables import (
    LONGEST_QUOTE as LONGEST_QUOTE,
    ParameterTable as ParameterTable,
    Quantity as Quantity,
    bundled_table as bundled_table,
    draw_table as draw_table,
    experiment_table as experiment_table,
    hand_table as hand_table,
    scan_table as scan_table,
    spine_table as spine_table,
    strength_table as strength_table,
    surface_table as surface_table,
    wall_table as wall_table,
)
