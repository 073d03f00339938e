from .generated import (
    RockSource as RockSource,
    generate_wall as generate_wall,
    named_wall as named_wall,
    read_rock as read_rock,
    wall_names as wall_names,
)
from .holes import Hole as Hole, Step as Step
from .meshing import mesh_scan as mesh_scan, too_large as too_large, too_small as too_small
from .pictures import plot_holds as plot_holds, plot_rock as plot_rock
from .reading import SCAN_ENDINGS as SCAN_ENDINGS, read_scan as read_scan
from .remedies import Remedy as Remedy, drop_outliers as drop_outliers, remedy as remedy
from .rock import ScannedRock as ScannedRock, write_rock as write_rock
from .scan import (
    UNIT_METRES as UNIT_METRES,
    UP_ROTATIONS as UP_ROTATIONS,
    Scan as Scan,
    Unit as Unit,
    Up as Up,
)
