"""Numbers of the search for climbs, and its tolerances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["SEARCH_SETTINGS", "SearchSettings"]


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """Numbers of directions, lifts and programs, and tolerances of load factors."""

    directions: int = 600
    """Directions of all states; further ones hardly rule out states other than their own."""
    samples: int = 60_000
    """Lifts from which directions are learnt in one round."""
    examples: int = 3_000
    """Lifts on which it is measured which directions rule out most."""
    stance_directions: int = 150
    """Directions that four hands have to pass before a lift is reached over them: those that rule
    out most lifts."""
    at_once: int = 128
    """Lifts whose programs are solved together."""
    step: float = 0.93
    """Part of a multiple that was too much, which is tried next."""
    lowest: float = 0.1
    """Multiple below which the next that is tried is zero."""
    standing: int = 24
    """Climbs that only shift the body which may be refused before those that lift are tried."""
    many: int = 300
    """Lifts of a body and a limb in the air from which on only the best are kept at first."""
    silence: float = 1.0
    """Time between two reports of progress [s]."""
    attempts: int = 3
    """Parents of a lift that are tried over four hands while only the best lifts are kept."""
    few: int = 500
    """Programs from which at least directions of all states are learnt anew."""
    offered: int = 600
    """Directions of such programs that may be taken."""
    taken: int = 60
    """Directions that are taken: those that rule out most."""
    first_step: float = 0.85
    """Part of a multiple that was left open, which is tried next."""
    better_steps: int = 300
    """Steps for a better climb among the best lifts."""
    first_steps: int = 120
    """Steps for one multiple, of ``at_once`` lifts each, before the first climb is known."""
    ratchet: float = 1e-3
    """Gap below which only climbs better than the best known are looked for."""
    exact: float = 1e-9
    """Part by which a climb has to be better than one that is known, and relative tolerance of the
    compiled programs' load factors."""
    unbounded: float = 1e9
    """Load factor that stands for one without a bound."""
    zero: float = 1e-11
    """What counts as zero in the compiled simplex method [1]: wrenches are in `WRENCH_UNIT`."""
    pivots: int = 2000
    """Steps of the simplex method at most; some forty are usual."""
    most_lifts: int = 12_000_000
    """Lifts that may be kept at once: some 1 GB."""


SEARCH_SETTINGS: Final = SearchSettings()
