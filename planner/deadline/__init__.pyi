from .clock import (
    Budget as Budget,
    DeadlineError as DeadlineError,
    Unfinished as Unfinished,
    check as check,
    check_after as check_after,
    expired as expired,
    late as late,
    late_sentence as late_sentence,
    left as left,
    seconds as seconds,
    within as within,
)
