"""How far a plan's utilisation may be above the least: what less tension is worth."""

__all__ = ["GIVEN_AWAY", "WEIGHT", "is_meant", "most_meant"]

GIVEN_AWAY = 1e-3
"""Of the least utilisation."""

WEIGHT = 0.05
"""Of the sum of squared relative tensions beside the utilisation."""


def most_meant(least: float, cap: float = 1.0) -> float:
    """Return the largest utilisation of a plan, given the least and the question's cap."""
    return max(least, min((1.0 + GIVEN_AWAY) * least, cap))


def is_meant(utilisation: float, least: float, cap: float = 1.0, agree: float = 1e-5) -> bool:
    """Whether a plan's utilisation is between the least and the most, but for a solver's digits."""
    off = agree * max(1.0, least)
    return least - off <= utilisation <= most_meant(least, cap) + off
