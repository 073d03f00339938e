"""Exceptions of the project: one base class, and a subclass for each way to react to the error."""

from __future__ import annotations

import copyreg
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

__all__ = [
    "CruxError",
    "EmptySetError",
    "InvalidFieldError",
    "InvalidInputError",
    "LimitError",
    "RefusedPlaceError",
    "SolverError",
    "UnsupportedError",
    "check_positive",
    "errors_under",
    "in_file",
]


class CruxError(Exception):
    """Base class of every exception that the project raises deliberately.

    Parameters
    ----------
    message : str
        One line that names the field, the value and the valid values.
    field : str, optional
        Path of the invalid field, such as ``stance.hands[0].hold.diameter``.

    Attributes
    ----------
    kind : str
        Short machine-readable class of the error, ``error.kind`` in replies.
    """

    kind = "error"

    def __init__(self, message: str, *, field: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.field = field

    def __reduce__(self) -> tuple[Any, ...]:
        # a class may be made of other things than its message
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]

    def within(self, parent: str) -> Self:
        """Prefix the error's field path with ``parent`` in place, and return the error.

        ``hold`` within ``stance.hands[0]`` becomes ``stance.hands[0].hold``.
        """
        if self.field is None:
            self.field = parent
        else:
            separator = "" if self.field.startswith("[") else "."
            self.field = f"{parent}{separator}{self.field}"
        return self

    def __str__(self) -> str:
        return f"{self.field}: {self.message}" if self.field else self.message


class InvalidInputError(CruxError):
    """A value that no model can work with (not finite, out of range, wrong shape, unknown name)."""

    kind = "invalid"


class InvalidFieldError(InvalidInputError, ValueError):
    """A part of a request that is invalid by itself.

    Being a ``ValueError`` too, it can be raised while msgspec decodes a struct; msgspec then adds
    the part's path in the message.
    """


class RefusedPlaceError(InvalidInputError):
    """A place on rock at which a hand cannot be.

    Parameters
    ----------
    message : str
    reason : str
        Short name of the reason, the same for all hands, fingers and numbers: ``scan_border``,
        ``palm_in_rock``, ``finger_in_rock``, ``no_equilibrium``, ``tendon_slack``, ``no_rest`` or
        ``unstable_rest``.
    field : str, optional
    """

    def __init__(self, message: str, *, reason: str, field: str | None = None) -> None:
        super().__init__(message, field=field)
        self.reason = reason


class UnsupportedError(InvalidInputError):
    """A value that is valid in principle, but that this version does not implement."""

    kind = "unsupported"


class LimitError(InvalidInputError):
    """A valid question that would take more time, memory or bytes than crux allows.

    The message has the largest amount that is allowed.
    """

    kind = "limit"


class EmptySetError(CruxError):
    """An empty set of wrenches or poses: its conditions contradict each other (infeasible)."""

    kind = "empty_set"


class SolverError(CruxError):
    """A numerical method without a result that passes its checks."""

    kind = "solver"


def check_positive(value: float, unit: str, field: str, most: float = sys.float_info.max) -> None:
    """Raise `InvalidInputError` unless 0 < ``value`` ≤ ``most``.

    Parameters
    ----------
    value : float
    unit, field : str
        Unit and field path for the message.
    most : float, optional
        Upper bound; by default the largest finite number, so that infinity and NaN are refused.
    """
    if not 0.0 < value <= most:
        needed = "finite and above 0" if value > sys.float_info.max else "above 0"
        bound = "" if most >= sys.float_info.max else f" and at most {most:g}"
        raise InvalidInputError(f"must be {needed}{bound} {unit}, got {value:g}", field=field)


@contextmanager
def errors_under(path: str) -> Iterator[None]:
    """Context manager that prefixes the field path of an `InvalidInputError` with ``path``."""
    try:
        yield
    except InvalidInputError as error:
        raise error.within(path) from None


@contextmanager
def in_file(name: str) -> Iterator[None]:
    """Context manager that turns errors of reading a TOML file into errors that name the file.

    Raises
    ------
    InvalidInputError
        In place of an OSError, a UnicodeDecodeError, a RecursionError, a ValueError or an
        InvalidInputError; its field is ``name``.
    """
    try:
        yield
    except OSError as error:
        raise InvalidInputError(error.strerror or str(error), field=name) from None
    except UnicodeDecodeError:
        raise InvalidInputError("must be TOML in UTF-8", field=name) from None
    except RecursionError:
        raise InvalidInputError("is nested too deep", field=name) from None
    except (ValueError, InvalidInputError) as error:
        raise InvalidInputError(str(error), field=name) from None
