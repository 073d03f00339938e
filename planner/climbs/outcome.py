"""Words and values that replies have of a climb, and of its search; imports little."""

from __future__ import annotations

from typing import Literal, NamedTuple

from msgspec import Struct

from planner.result import LimitName

__all__ = ["ClimbProgress", "ClimbStatus", "DecidingStage", "Raise", "RefusedMoves"]

ClimbStatus = Literal["found", "not_proven", "none", "blocked", "unknown"]
"""``found``: a climb, and no other is better by more than was asked for; ``not_proven``: a climb;
``none``: it is proven that there is none; ``blocked``: the hands could hold one, but the moves of
all that were found have no plan; ``unknown``: none was found in time."""


class ClimbProgress(NamedTuple):
    """Progress of the search for a climb.

    Attributes
    ----------
    phase : {'search', 'steps', 'moves', 'stages', 'changes'}
    best, bound : float or None
        Least load factor of the best climb so far, and the bound of all.
    seconds : float
        Since the beginning [s].
    done, total : int
        Moves that are planned, and their number; zero in other phases.
    """

    phase: str
    best: float | None
    bound: float | None
    seconds: float
    done: int = 0
    total: int = 0


class RefusedMoves(Struct, frozen=True, kw_only=True):
    """Kind of moves that have no plan.

    Attributes
    ----------
    limb : str or None
    phase : str
        Part of the move, as of `Knot`.
    reason : str
        Of the last one.
    count : int
    """

    limb: str | None
    phase: str
    reason: str
    count: int


class DecidingStage(Struct, frozen=True, kw_only=True):
    """The stage with the least load factor.

    Attributes
    ----------
    stage, move : int
        As of `RouteStage`.
    phase : {'start', 'shift', 'lift', 'place'}
    limb : str or None
        The limb that moves.
    load_factor : float
        Of its verified plan.
    limiting : LimitName or None
        The limit that is used most.
    placements : dict of str to int
        Index of the placement of each hand on the rock, by limb.
    body : int
        Index of the pose of the body.
    """

    stage: int
    move: int
    phase: str
    limb: str | None
    load_factor: float
    limiting: LimitName | None
    placements: dict[str, int]
    body: int


class Raise(Struct, frozen=True, kw_only=True):
    """A change that raises the load factor of a stage.

    Attributes
    ----------
    kind : {'strength', 'mass', 'place'}
    limb : str or None
        Whose hand changes; None for the mass.
    change : str
        In words.
    load_factor : float
        Of the stage with the change: by a verified plan; with another placement by its linear
        program.
    """

    kind: str
    limb: str | None
    change: str
    load_factor: float
