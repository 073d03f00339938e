from .boundary import stretch_minima as stretch_minima
from .outlines import BLOCK as BLOCK, Outlines as Outlines
from .polyline import PolylineSection as PolylineSection
from .section import (
    LEVEL as LEVEL,
    Complexes as Complexes,
    Face as Face,
    Flags as Flags,
    Rest as Rest,
    Section as Section,
    Vector2 as Vector2,
)
from .smooth import Disc as Disc, SmoothSection as SmoothSection, Wall as Wall
from .swept_cuts import (
    PARALLEL as PARALLEL,
    FingerPlane as FingerPlane,
    Swept as Swept,
    cut_of as cut_of,
    entry_distances as entry_distances,
)
