"""Functions on arrays that numba compiles: on each machine once, and then from its cache."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

__all__ = ["compiled"]

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(*arguments: str) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function for arguments of given types.

    The function is compiled where it is defined, or loaded from numba's cache if the cache has it
    of the same module. Modules with compiled functions are imported where these are used, as numba
    takes a quarter of a second. Such a function calls no compiled one of another module: the cache
    would not notice a change there.

    Parameters
    ----------
    *arguments : str
        For each argument ``f`` (float) or ``i`` (int), then the number of its dimensions, 0 for a
        number. An array lies in one piece, row by row, and is not written to. Without arguments the
        function is for other compiled ones of its module alone.
    """
    import numba

    kinds = {"f": numba.float64, "i": numba.intp}
    types = [_type(kinds[each[0]], int(each[1:])) for each in arguments]

    def decorated(function: Function) -> Function:
        try:
            made = numba.njit(tuple(types) or None, cache=bool(types))(function)
        except RuntimeError:
            # there is no folder in which numba can keep it
            made = numba.njit(tuple(types) or None)(function)
        return cast("Function", made)

    return decorated


def _type(kind: Any, dimensions: int) -> Any:
    from numba import types

    return types.Array(kind, dimensions, "C", readonly=True) if dimensions else kind
