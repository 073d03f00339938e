from .budget import Budget as Budget
from .clock import (
    DeadlineError as DeadlineError,
    check as check,
    expired as expired,
    left as left,
    possible as possible,
    seconds as seconds,
    within as within,
)
from .overlap import Beside as Beside, begin as begin
from .unfinished import Unfinished as Unfinished, late_sentence as late_sentence
