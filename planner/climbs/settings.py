"""Numbers of the choice of a climb's joint angles."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PostureSettings", "StepSettings"]


@dataclass(frozen=True, slots=True)
class PostureSettings:
    """Shares of limits and steps with which joint angles are chosen before moves are planned."""

    torque_share: float = 0.9
    """Part of joint torque limits in a state [1]; the rest is left for knots between the states,
    at which joints may bear more."""
    step: float = 0.06
    """Way of the body between two poses that are looked at, at most [m]: about as far as a climb's
    set-points are apart."""
    swing_parts: int = 2
    """Parts of a swing after each of which loads are looked at: those halfway are seldom the
    largest."""
    ways: int = 8
    """Ways of a hold at most: a limb of seven joints has some four to eight kinds of them."""
    few_ways: int = 4
    """Ways of a hold from the reach table below which others are searched for."""
    plans: int = 8
    """Choices of joint angles whose moves are planned for one climb, at most."""
    tries: int = 1500
    """Ways that are tried for one climb at most; where a climb has a choice, a hundred do."""


@dataclass(frozen=True, slots=True)
class StepSettings:
    """Numbers of the search for a first climb step by step, which set the order of its steps."""

    shift: float = 0.3
    """Part of a move that a shift of the body counts [1]."""
    visit: float = 0.2
    """What a lift is put back by each time it was made [moves], so that others are tried, too."""
    failure: float = 0.5
    """What a lift is put back by each time its limb could not let go [moves]."""
    no_place: float = 0.15
    """What it is put back by each time its limb could not be placed [moves]."""
    start: float = 0.6
    """What a lift from the start is put back by each time [moves]."""
    stances: int = 6
    """Stances of the start that are looked at for each lift: those that may hold most."""
    ways: int = 3
    """Postures of a state at most, and joint angles of a limb on a hold."""
    out: int = 64
    """Lifts that were ruled out from which on moves are counted anew."""
    steps: int = 2000
    """Steps between two counts of moves, which take seconds."""
    time: float = 0.5
    """Part of the time that is left which it may take [1]."""
    plans: int = 40
    """Climbs whose moves are planned, at most."""
