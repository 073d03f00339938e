"""Changes of a question that make its stance feasible or lower its utilisation, all verified."""

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
    """A change of a question, with the verified plan of the changed question.

    Attributes
    ----------
    kind : str
        ``body``: shift and tilt the body; ``place``: move or turn a hand on its rock, which stays;
        ``grasp``: close one or all hands with other angles of outer fingers or closing tensions;
        ``let_go``: remove a hand; ``free_hand``: add a hand, if rock is there; ``new_hold``: put a
        hand elsewhere, if rock is there; ``strength``: one or all holds stronger; ``mass``: a
        lighter body; ``pair``: two of these; ``combination``: more than two.
    limbs : list of str
        Limbs whose hands change; empty for the body.
    sentence : str
        What to do, in the words of the question; for ``strength`` and ``mass`` a condition.
    changes : dict of str to any
        New values of fields of the plan request, by path. Null removes a field, or a hand. A hand
        whose value is the path of another hand is new: a copy of that hand, except for the further
        values given here. Indices of hands are those of the question: new hands are added first,
        hands are removed last.
    size : float
        Size of the change, without unit. Body: shift over 0.1 m plus tilt over 0.2 rad. Place:
        distance over 0.02 m plus turn over 0.5 rad. Grasp: turn of outer fingers over π/2 plus
        change of closing tension over 10 N, summed over hands. Hand added, removed or put
        elsewhere: 2. Strength: ln of the factor over ln 1.1, summed over hands. Mass: ln of the
        factor by which the body is lighter over ln 1.1. Several changes: the sum.
    status : str
        Status of the changed question's plan: ``optimal`` or ``overloaded``.
    utilisation : float
        Utilisation of the changed question's plan.
    load_factor : float or None
        Load factor of the changed question; None if none was found.
    load_factor_status : {'found', 'at_least', 'unbounded', 'none', 'not_finished'}
        Whether the load factor was found; if not, why: it is unbounded, there is none, or the
        deadline expired first.
    holds : bool
        Whether the utilisation is within the question's cap.
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
