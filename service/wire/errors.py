"""Define the errors between a caller and the service."""

from __future__ import annotations

from typing import Final

from hand_models.base import CruxError, InvalidInputError

__all__ = [
    "REQUEST_KINDS",
    "BusyError",
    "LostError",
    "MalformedError",
    "NoServiceError",
    "ServiceError",
    "ServiceTimeout",
]

REQUEST_KINDS: Final = frozenset({"malformed", "invalid", "unsupported", "limit", "unreachable"})
"""Kinds of error in the request; the same request would fail again."""


class BusyError(CruxError):
    """A question that a service has no room for now.

    Parameters
    ----------
    message : str
    retry_after : float
        Time after which to ask again [s].

    Attributes
    ----------
    retry_after
    """

    kind = "busy"

    def __init__(self, message: str, retry_after: float) -> None:
        super().__init__(message)
        self.retry_after = retry_after


class MalformedError(InvalidInputError):
    """Bytes that are not the encoding they claim to be, or too many of them."""

    kind = "malformed"


class ServiceError(CruxError):
    """The service's own error reply.

    Parameters
    ----------
    kind : str
        As in the reply.
    message : str
    field : str, optional
    retry_after : float, optional
        Time after which to ask a busy service again [s].

    Attributes
    ----------
    kind, message, field, retry_after
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
    """A request that no process lived to answer."""

    kind = "lost"


class NoServiceError(CruxError):
    """Nobody answered: no service, or one that died with the question in its hands."""

    kind = "no_service"


class ServiceTimeout(CruxError):  # noqa: N818 - a timeout says what it is
    """The service took the question but did not answer in time."""

    kind = "timeout"
