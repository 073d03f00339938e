"""Errors that a client of the service can get, each with its ``kind`` on the wire."""

from __future__ import annotations

from typing import Final

from hand_models.base import CruxError, InvalidInputError

__all__ = [
    "REQUEST_KINDS",
    "BusyError",
    "CancelledError",
    "LostError",
    "MalformedError",
    "NoServiceError",
    "ServiceError",
    "ServiceTimeout",
]

REQUEST_KINDS: Final = frozenset({"malformed", "invalid", "unsupported", "limit", "unreachable"})
"""Kinds of error whose cause is the request; a retry of the same request would fail again."""


class BusyError(CruxError):
    """Error: the service's queue is full, and the client should retry later.

    Parameters
    ----------
    message : str
        Error message.
    retry_after : float
        Time after which the client should retry [s].

    Attributes
    ----------
    retry_after : float
        Time after which the client should retry [s].
    """

    kind = "busy"

    def __init__(self, message: str, retry_after: float) -> None:
        super().__init__(message)
        self.retry_after = retry_after


class CancelledError(CruxError):
    """Error: the client that asked has cancelled its question."""

    kind = "cancelled"


class MalformedError(InvalidInputError):
    """Error: the request is not in the encoding that it claims, or its structure is broken."""

    kind = "malformed"


class ServiceError(CruxError):
    """Error that the client raises for an error reply of the service.

    Parameters
    ----------
    kind : str
        Kind of error, from the reply.
    message : str
        Error message, from the reply.
    field : str, optional
        Path of the request's field that is to blame.
    retry_after : float, optional
        Time after which to retry, from a busy service [s].

    Attributes
    ----------
    kind : str
        Kind of error.
    message : str
        Error message.
    field : str or None
        Path of the request's field that is to blame.
    retry_after : float or None
        Time after which to retry [s].
    """

    def __init__(
        self,
        kind: str,
        message: str,
        *,
        field: str | None = None,
        retry_after: float | None = None,
    ) -> None:
        super().__init__(message, field=field)
        self.kind = kind
        self.retry_after = retry_after


class LostError(CruxError):
    """Error: every worker that got the request died before it answered."""

    kind = "lost"


class NoServiceError(CruxError):
    """Error: no service can be reached, or the service ended before it answered."""

    kind = "no_service"


class ServiceTimeout(CruxError):  # noqa: N818 - a timeout says what it is
    """Error: the service did not answer before the client's timeout."""

    kind = "timeout"
