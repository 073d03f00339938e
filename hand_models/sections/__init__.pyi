from .boundary import stretch_minima as stretch_minima
from .outlines import Outlines as Outlines
from .polyline import PolylineSection as PolylineSection
from .profile_section import ProfileSection as ProfileSection
from .rows import Flags as Flags, Span as Span
from .section import (
    LEVEL as LEVEL,
    Complexes as Complexes,
    FlatSection as FlatSection,
    Rest as Rest,
    RoundSection as RoundSection,
    Section as Section,
    Vector2 as Vector2,
)
from .smooth_cuts import Face as Face, SmoothCut as SmoothCut
from .swept_ball import PARALLEL as PARALLEL, Swept as Swept, entry_distances as entry_distances
from .swept_cuts import FingerPlane as FingerPlane, cut_of as cut_of
