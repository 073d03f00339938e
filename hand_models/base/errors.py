"""The project's exceptions: one base, and a class for each thing a caller can do about it."""

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
    "SolverError",
    "UnsupportedError",
    "check_positive",
    "errors_under",
    "in_file",
]


class CruxError(Exception):
    """Base of every exception that the project raises on purpose.

    Parameters
    ----------
    message : str
        One line that names the field, the value and what would be valid.
    field : str, optional
        Path of the field to blame, such as ``stance.hands[0].hold.diameter``.

    Attributes
    ----------
    kind : str
        Short machine-readable class of the error; travels as ``error.kind``.
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
        """Return the error with ``parent`` put before its field's path."""
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
    """A part of a request that is impossible by itself.

    As a ``ValueError`` of a struct that is being decoded, msgspec says where in the message it is.
    """


class UnsupportedError(InvalidInputError):
    """A value that is meaningful, but that this version does not implement."""

    kind = "unsupported"


class LimitError(InvalidInputError):
    """A question that is meaningful, but would cost more than is allowed; it names the limit."""

    kind = "limit"


class EmptySetError(CruxError):
    """A set of wrenches in which nothing is left: its rows contradict each other."""

    kind = "empty_set"


class SolverError(CruxError):
    """A numerical method that gave no answer which passes its checks."""

    kind = "solver"


def check_positive(value: float, unit: str, field: str, most: float = sys.float_info.max) -> None:
    """Refuse a number that is not above 0, or above the most; without that, what is not finite."""
    if not 0.0 < value <= most:
        bound = "" if most >= sys.float_info.max else f" and at most {most:g}"
        raise InvalidInputError(f"must be above 0{bound} {unit}, got {value:g}", field=field)


@contextmanager
def errors_under(path: str) -> Iterator[None]:
    """Put a path before the field of an error."""
    try:
        yield
    except InvalidInputError as error:
        raise error.within(path) from None


@contextmanager
def in_file(name: str) -> Iterator[None]:
    """Put the name of a TOML file before an error of reading it, or of what it says."""
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
