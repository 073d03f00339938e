"""Read a reply that zenoh has delivered as a typed message."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import msgspec

from service.wire.codec import Format
from service.wire.errors import MalformedError, ServiceError

if TYPE_CHECKING:
    import zenoh

__all__ = ["read_reply"]

ReplyT = TypeVar("ReplyT", bound=msgspec.Struct)


def read_reply(received: zenoh.Sample | zenoh.ReplyError, kind: type[ReplyT]) -> ReplyT:
    """Decode a reply in the format that its zenoh encoding names.

    Parameters
    ----------
    received : zenoh.Sample or zenoh.ReplyError
        What zenoh has delivered.
    kind : type
        Type of the reply.

    Raises
    ------
    ServiceError
        If the bytes are no such reply, as of a service of another version.
    """
    try:
        return Format.named(str(received.encoding)).decode(received.payload.to_bytes(), kind)
    except (MalformedError, msgspec.ValidationError) as error:
        raise ServiceError(
            "internal",
            f"the reply is not a {kind.__name__} ({error}): run client and service of one version",
        ) from None
