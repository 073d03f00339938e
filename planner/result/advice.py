"""Changes that would make a stance hold, or hold more, planned and verified."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct

from planner.result.plain_parts import LoadFactorStatus

__all__ = ["Advice", "AdviceKind"]

AdviceKind = Literal[
    "body",
    "place",
    "grasp",
    "let_go",
    "free_hand",
    "new_hold",
    "strength",
    "mass",
    "pair",
    "combination",
]


class Advice(Struct, frozen=True):
    """A change of a question, planned and verified as the changed question would be.

    Attributes
    ----------
    kind : str
        ``body``: shift and tilt it; ``place``: move or turn a hand on its rock, which stays;
        ``grasp``: take a hold, or all, with outer fingers or closing tension otherwise;
        ``let_go``: without a hand; ``free_hand``: with one more, if rock is there; ``new_hold``:
        with a hand elsewhere, if rock is there; ``strength``: a stronger hold, or all;
        ``mass``: a lighter body; ``pair``: two of these; ``combination``: more of them.
    limbs : list of str
        Whose hands it is about; none for the body.
    sentence : str
        What to do, in the words of the question; for ``strength`` and ``mass`` a condition.
    changes : dict of str to any
        Fields of the plan request by their paths, and their new values. Null takes a field away,
        and a hand. A hand whose value is the path of another one is new, and a copy of that one
        but for its other values in here. Hands are counted as in the question: new ones come
        first, hands are taken away last.
    size : float
        How large the change is: the body's shift over 0.1 m plus its tilt over 0.2 rad; a hand's
        way over 0.02 m plus its turn over 0.5 rad; the turn of outer fingers over π/2 and the
        change of closing tension over 10 N, summed over hands; 2 for a hand more, less or
        elsewhere; ln of how many times as strong holds become over ln 1.1, summed over hands; ln of
        how many times lighter the body becomes over ln 1.1. Of several changes the
        sum.
    status : str
        ``optimal`` or ``overloaded``, with the change.
    utilisation : float
    load_factor : float or None
    load_factor_status : {'found', 'at_least', 'unbounded', 'none', 'not_finished'}
        Whether it is there; why not: there is no end to it, there is none, or no time to find it.
    holds : bool
        Whether the utilisation is within the cap that was asked for.
    """

    kind: AdviceKind
    limbs: list[str]
    sentence: str
    changes: dict[str, Any]
    size: float
    status: Literal["optimal", "overloaded"]
    utilisation: float
    load_factor: float | None
    holds: bool
    load_factor_status: LoadFactorStatus = "not_asked"
