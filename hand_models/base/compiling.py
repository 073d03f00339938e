"""Functions on arrays that numba compiles: on each machine once, and then from its cache."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

__all__ = ["compiled", "record_of"]

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(*arguments: str | np.dtype[Any]) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function for arguments of given types.

    The function is compiled where it is defined, or loaded from numba's cache if the cache has it
    of the same module. Modules with compiled functions are imported where these are used, as numba
    takes a quarter of a second. Such a function calls no compiled one of another module: the cache
    would not notice a change there. For the same reason it has numbers of other modules as
    arguments.

    Parameters
    ----------
    *arguments : str or numpy.dtype
        For each argument ``f`` (float), ``c`` (complex), ``i`` (int) or ``b`` (bool), then the
        number of its dimensions, 0 for a number. An array lies in one piece, row by row, and is not
        written to. Or the fields of records: for an array of these, which may be written to.
        Without arguments the function is for other compiled ones of its module alone.
    """
    import numba

    types = [_type(each) for each in arguments]

    def decorated(function: Function) -> Function:
        try:
            made = numba.njit(tuple(types) or None, cache=bool(types))(function)
        except RuntimeError:
            # there is no folder in which numba can keep it
            made = numba.njit(tuple(types) or None)(function)
        return cast("Function", made)

    return decorated


def record_of(numbers: Mapping[str, float]) -> NDArray[np.void]:
    """Return numbers with their names as an array of one record, for compiled functions."""
    fields = [(name, np.asarray(number).dtype) for name, number in numbers.items()]
    return np.array([tuple(numbers.values())], dtype=fields)


def _type(argument: str | np.dtype[Any]) -> Any:
    import numba

    if not isinstance(argument, str):
        return numba.types.Array(numba.from_dtype(argument), 1, "C")
    kinds = {"f": numba.float64, "c": numba.complex128, "i": numba.intp, "b": numba.bool_}
    kind, dimensions = kinds[argument[0]], int(argument[1:])
    return numba.types.Array(kind, dimensions, "C", readonly=True) if dimensions else kind
