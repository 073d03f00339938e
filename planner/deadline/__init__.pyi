from .budget import Budget as Budget
from .clock import (
    DeadlineError as DeadlineError,
    check as check,
    expired as expired,
    left as left,
    seconds as seconds,
    within as within,
)
from .overlap import Overlap as Overlap, begin_overlap as begin_overlap
from .unfinished import (
    Unfinished as Unfinished,
    late as late,
    late_sentence as late_sentence,
)
