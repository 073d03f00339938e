"""Functions on arrays that numba compiles: on each machine once, and then from its cache."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from hand_models.base.long_work import without_collection

__all__ = ["compiled", "has_compiled", "record_of"]

Argument = str | np.dtype[Any] | Callable[..., Any] | tuple[Any, ...]
"""What stands for the type of an argument of a compiled function (`compiled`)."""

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(*arguments: Argument) -> Callable[[Function], Function]:
    """Return a decorator that compiles a function for arguments of given types.

    The function is compiled when its module is imported, or loaded from numba's cache if the module
    has not changed since. Import such modules only where their functions are used: importing numba
    takes a quarter of a second. A compiled function may not call compiled functions of other
    modules or read their numbers, since numba's cache does not notice a change there; it takes such
    numbers and functions as arguments.

    Parameters
    ----------
    *arguments : str, numpy.dtype, function or tuple
        For each argument ``f`` (float), ``c`` (complex), ``i`` (int) or ``b`` (bool), then the
        number of its dimensions, 0 for a number. Such an array is contiguous, row by row, and is
        not written to. A tuple of arguments, or several with blanks between, stands for a tuple. A
        dtype stands for an array of its records, which may be written to. A compiled function
        stands for one with its arguments and result, which is called by its address: so those of
        other modules are called. To hand one over takes 0.1 ms. A function without ``arguments``
        can only be called by compiled functions of its own module.
    """
    import numba

    types = [_type(each) for each in arguments]

    def decorated(function: Function) -> Function:
        # numba makes millions of objects, and needs most of them
        with warnings.catch_warnings(), without_collection():
            # that functions are handed over is called experimental, since 2020
            warnings.simplefilter("ignore", numba.NumbaExperimentalFeatureWarning)
            return _made(function)

    def _made(function: Function) -> Function:
        try:
            made = numba.njit(tuple(types) or None, cache=bool(types))(function)
        except RuntimeError:
            # there is no folder in which numba can keep it
            made = numba.njit(tuple(types) or None)(function)
        return cast("Function", made)

    return decorated


def has_compiled(module: str) -> bool:
    """Return whether numba's cache has a module's functions as the module is now.

    Looks for files alone: numba is not imported, nor is the module.

    Parameters
    ----------
    module : str
        Full name of a module with `compiled` functions.
    """
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        return False
    source = Path(spec.origin)
    changed = source.stat().st_mtime
    own = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "numba")
    # numba keeps what it compiles beside the source, or where it cannot write there, of each user
    places = [Path(own)] if own else [source.parent / "__pycache__", home]
    return any(
        kept.stat().st_mtime > changed
        for place in places
        for kept in place.rglob(f"{source.stem}.*.nbi")
    )


def record_of(numbers: Mapping[str, float]) -> NDArray[np.void]:
    """Return named numbers as an array of one record, shape (1,), for compiled functions."""
    fields = [(name, np.asarray(number).dtype) for name, number in numbers.items()]
    return np.array([tuple(numbers.values())], dtype=fields)


def _type(argument: Argument) -> Any:
    import numba

    if isinstance(argument, tuple):
        several: Any = numba.types.Tuple
        return several([_type(each) for each in argument])
    if callable(argument):
        made: Any = argument
        return numba.types.FunctionType(made.nopython_signatures[0])
    if not isinstance(argument, str):
        return numba.types.Array(numba.from_dtype(argument), 1, "C")
    if " " in argument:
        return _type(tuple(argument.split()))
    kinds = {"f": numba.float64, "c": numba.complex128, "i": numba.intp, "b": numba.bool_}
    kind, dimensions = kinds[argument[0]], int(argument[1:])
    return numba.types.Array(kind, dimensions, "C", readonly=True) if dimensions else kind
