from .border import (
    TOLERANCE as TOLERANCE,
    Border as Border,
    Held as Held,
    border_in_words as border_in_words,
    held as held,
)
from .design import Design as Design
from .evaluation import Row as Row, asking as asking
from .figures import plot_sweep as plot_sweep
from .result import (
    Sweep as Sweep,
    has_borders as has_borders,
    sweep as sweep,
    swept as swept,
)
from .table import (
    PointRows as PointRows,
    Points as Points,
    about as about,
    columns_of as columns_of,
)
from .variation import Variation as Variation, word_of as word_of
