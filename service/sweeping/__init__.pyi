from .border import (
    BORDER_TOLERANCE as BORDER_TOLERANCE,
    Border as Border,
    Held as Held,
    held as held,
)
from .design import Design as Design
from .pictures import plot_sweep as plot_sweep
from .results import Sweep as Sweep, sweep as sweep, with_borders as with_borders
from .rows import PointRows as PointRows, SweepRow as SweepRow, asking as asking
from .variation import Variation as Variation, word_of as word_of
