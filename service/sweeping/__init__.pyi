from .border import (
    TOLERANCE as TOLERANCE,
    Border as Border,
    Held as Held,
    border_in_words as border_in_words,
    held as held,
)
from .design import Design as Design
from .evaluation import Row as Row
from .figures import plot_sweep as plot_sweep
from .result import Sweep as Sweep, answered as answered, sweep as sweep
from .variation import Variation as Variation, word_of as word_of
