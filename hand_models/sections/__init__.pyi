from .boundary import strung as strung
from .finger_rock import (
    NO_STRIPS as NO_STRIPS,
    FingerRock as FingerRock,
    FingerSize as FingerSize,
    RockStrips as RockStrips,
)
from .outlines import Outlines as Outlines
from .polyline import PolylineSection as PolylineSection
from .section import (
    Complexes as Complexes,
    Face as Face,
    Flags as Flags,
    Rest as Rest,
    Section as Section,
    Vector2 as Vector2,
)
from .settings import SECTION_SETTINGS as SECTION_SETTINGS
from .smooth import Disc as Disc, FlatRock as FlatRock, SmoothSection as SmoothSection
from .swept_cuts import (
    FingerPlane as FingerPlane,
    Swept as Swept,
    cut_of as cut_of,
    entry_distances as entry_distances,
)
from .swept_envelopes import alike_across as alike_across, rock_across as rock_across
