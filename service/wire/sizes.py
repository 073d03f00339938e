"""Limit the bytes of requests by their type."""

from __future__ import annotations

from typing import Final

from hand_models.base import LimitError
from service.requests import CancelRequest, SetPointsRequest, StreamRequest, WrenchRequest

__all__ = ["LARGEST_REQUEST", "check_size", "most_bytes"]

LARGEST_REQUEST: Final = 2**26
"""Maximum bytes of a request: a stance has some thousand, a scan of 200,000 triangles about 10⁷."""


def most_bytes(kind: type) -> int:
    """Return the maximum bytes of a request of a given type; larger payloads are not decoded."""
    if kind in (SetPointsRequest, WrenchRequest, CancelRequest):
        return 2**12  # no rock
    if kind is StreamRequest:
        return 2**24  # streams are kept: sixteen of them have to fit into one process
    return LARGEST_REQUEST


def check_size(size: int, kind: type) -> None:
    """Raise an error for a payload that is larger than its request type allows.

    Parameters
    ----------
    size : int
        Of the payload [bytes].
    kind : type

    Raises
    ------
    LimitError
        If the payload has more bytes than `most_bytes` of the type.
    """
    most = most_bytes(kind)
    if size > most:
        advice = (
            "ask for one body wrench at a time, with a shorter id"
            if kind is SetPointsRequest
            else "publish one body wrench at a time, and nothing else"
            if kind is WrenchRequest
            else "let hands share a scan under stance.rocks, cut it to what is near them, or make "
            "its triangles larger (crux rock --spacing)"
        )
        raise LimitError(f"{size} bytes; a {kind.__name__} may have {most} at most: {advice}")
