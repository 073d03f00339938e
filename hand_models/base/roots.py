"""Find where a function that is dear to compute is zero."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["root_between"]


def root_between(
    function: Callable[[float], float],
    ends: tuple[float, float],
    values: tuple[float, float],
    accuracy: float,
) -> float:
    """Return where a function is zero between two places at which its values are known.

    By Brent's method, which would otherwise ask for these values again.

    Parameters
    ----------
    function : callable
        Continuous function of one number.
    ends : tuple of float
        The two places.
    values : tuple of float
        The function's values there, of opposite signs.
    accuracy : float
        Largest distance from the root.
    """
    from scipy.optimize import brentq

    known = dict(zip(ends, values, strict=True))
    return float(brentq(lambda x: known[x] if x in known else function(x), *ends, xtol=accuracy))
