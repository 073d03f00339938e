"""Numbers of the choice of a climb's joint angles."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PostureSettings"]


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
