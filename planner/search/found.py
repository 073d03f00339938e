"""The answer of a search: a climb, a bound of every other, and what the bound rests on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from hand_models.base import Array, Indices
from planner.search.wall import State

__all__ = ["Found", "Proof"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Proof:
    """Directions that rule out so many states of a wall that no climb leads on.

    A state is ruled out if the supports σ of its hands leave no multiple s ≥ ``multiple`` of its
    body wrench w: Σ σ(d) ≥ s d·w for all its directions d. Its directions are those of all states,
    and those of its own members. One goes from four hands on the rock to three and back at the same
    body, and with four hands from body to body of ``Wall.shifts``.

    Attributes
    ----------
    multiple : float
        No climb without states that are ruled out leads from the start to the goal.
    directions : ndarray, shape (D, 6)
        Directions of all states, in wrenches over `WRENCH_UNIT`.
    members : ndarray of int, shape (N, L)
        Placements of states with directions of their own, at any body; −1 for the limb in the air.
    own : ndarray, shape (N, 6)
        The direction of each; the same members may occur again.
    backward : bool
        Whether fewer states are connected with the goal than with the start.
    """

    multiple: float
    directions: Array
    members: Indices
    own: Array
    backward: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class Found:
    """The best climb that was found, and how much better any other could be.

    Attributes
    ----------
    states : tuple of State
        The climb: four hands at the start, then states of which each differs from the one before
        by the pose of the body, by a limb that is lifted, or by a limb that is placed. () without a
        climb.
    factors : ndarray, shape (len(states),)
        Load factor of each state, by its linear program.
    least : float
        The least of them; −∞ without a climb.
    bound : float
        No climb on these placements and bodies, as far as the reach table goes, has a larger least
        load factor; −∞ if there is none.
    proof : Proof or None
        What the bound rests on; None if nothing was ruled out.
    programs : int
        Linear programs that were solved.
    lifts : int
        States with three hands that no direction ruled out at the lowest multiple looked at.
    seconds : float
        Duration of the search [s].
    finished : bool
        Whether the search ended by itself: the climb is as good as was asked for, or proven to be
        the best, or none exists.
    """

    states: tuple[State, ...]
    factors: Array
    least: float
    bound: float
    proof: Proof | None
    programs: int
    lifts: int
    seconds: float
    finished: bool

    @property
    def gap(self) -> float:
        """Part by which another climb's least load factor may be larger; infinite without one."""
        return self.bound / self.least - 1.0 if self.least > 0.0 else float(np.inf)

    @classmethod
    def nothing(cls) -> Self:
        """Return the answer of a search that was broken off before it had one."""
        return cls(
            states=(),
            factors=np.zeros(0),
            least=-np.inf,
            bound=np.inf,
            proof=None,
            programs=0,
            lifts=0,
            seconds=0.0,
            finished=False,
        )
