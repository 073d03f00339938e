from .own import LARGEST as LARGEST, load_own_hand as load_own_hand, own_hand as own_hand
from .tables import (
    LONGEST_QUOTE as LONGEST_QUOTE,
    ParameterTable as ParameterTable,
    Quantity as Quantity,
    experiment_table as experiment_table,
    hand_table as hand_table,
    scan_table as scan_table,
    spine_table as spine_table,
    surface_table as surface_table,
)
