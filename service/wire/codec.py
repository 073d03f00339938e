"""How messages travel: JSON or MessagePack, named by a zenoh encoding."""

from __future__ import annotations

from contextlib import suppress
from enum import Enum
from typing import Any, Final, TypeVar

import msgspec

from hand_models.base import CruxError, InvalidInputError
from service.replies import ErrorDetail, ErrorReply
from service.requests import Identifier
from service.wire.checks import check
from service.wire.errors import BusyError, MalformedError
from service.wire.validation_errors import leaves_open, validation_error

__all__ = ["LARGEST_REQUEST", "Format", "decode_request", "encode_error", "identifier"]

T = TypeVar("T")

LARGEST_REQUEST: Final = 2**26
"""Bytes of a request; a stance takes a few thousand, a scan of 200,000 triangles about 10⁷."""

ALIASES: Final = {
    "": "application/json",
    "zenoh/bytes": "application/json",
    "text/json": "application/json",
}


class Format(Enum):
    """A way to write a message down; the value is its encoding."""

    JSON = "application/json"
    MSGPACK = "application/msgpack"

    @classmethod
    def named(cls, encoding: str) -> Format:
        """Return the format of a zenoh encoding, whatever schema it names after a semicolon.

        No encoding, and zenoh's own default, mean JSON.

        Raises
        ------
        MalformedError
            If the encoding is of neither format.
        """
        plain = encoding.partition(";")[0].strip().lower()
        try:
            return cls(ALIASES.get(plain, plain))
        except ValueError:
            raise MalformedError(
                f"unknown encoding {plain[:80]!r}; valid: {', '.join(f.value for f in cls)}"
            ) from None

    def label(self, message: msgspec.Struct) -> str:
        """Return the encoding of a message with its schema, as in ``…/json;crux.PlanReply@1``."""
        return f"{self.value};crux.{type(message).__name__}@1"

    def encode(self, message: object) -> bytes:
        """Return a message as bytes."""
        if self is Format.JSON:
            return msgspec.json.encode(message)
        return msgspec.msgpack.encode(message)

    def decode(self, payload: bytes, kind: type[T]) -> T:
        """Return bytes as a message.

        Raises
        ------
        msgspec.ValidationError
            If they are another message.
        MalformedError
            If they are none.
        """
        try:
            if self is Format.JSON:
                return msgspec.json.decode(payload, type=kind)
            return msgspec.msgpack.decode(payload, type=kind)
        except msgspec.ValidationError:
            raise
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise MalformedError(f"not {self.name.lower()}: {error}") from None
        except RecursionError:
            raise MalformedError("nested too deeply") from None


def decode_request(payload: bytes, kind: type[T], form: Format = Format.JSON) -> T:
    """Return bytes as a request that has passed every check which needs no model.

    Raises
    ------
    InvalidInputError
        With the field to blame; as `MalformedError` or `UnsupportedError` where that is the case.
    """
    if len(payload) > LARGEST_REQUEST:
        raise MalformedError(f"{len(payload)} bytes; a request may have {LARGEST_REQUEST} at most")
    try:
        request = form.decode(payload, kind)
    except msgspec.ValidationError as error:
        if form is Format.MSGPACK and "Expected `float`" in str(error):
            # no bound is kept by what is not a number
            with suppress(RecursionError):
                check(_plain(payload, form))
        document = _plain(payload, form) if leaves_open(error) else None
        field, message = validation_error(
            error, kind, document, lambda part: form.decode(form.encode(part), kind)
        )
        raise InvalidInputError(message, field=field) from None
    try:
        check(request)
    except RecursionError:
        raise MalformedError("nested too deeply") from None
    return request


def _plain(payload: bytes, form: Format) -> Any:
    """Return bytes as plain lists and dicts, or None where they go on as no message."""
    try:
        return form.decode(payload, Any)
    except (MalformedError, msgspec.ValidationError):
        return None


class _Named(msgspec.Struct):
    id: Identifier | None = None


def identifier(payload: bytes, form: Format) -> str | None:
    """Return a request's ``id``, whatever else is wrong with it; None where it cannot be read."""
    if len(payload) > LARGEST_REQUEST:
        return None
    try:
        return form.decode(payload, _Named).id
    except (MalformedError, msgspec.ValidationError):
        return None


def encode_error(
    kind: str, error: CruxError, form: Format, name: str | None = None
) -> tuple[bytes, str]:
    """Return an error reply's bytes and encoding; ``name`` is the request's ``id``."""
    detail = ErrorDetail(kind, error.field, error.message)
    if isinstance(error, BusyError):
        detail.retry_after = error.retry_after
    reply = ErrorReply(id=name, error=detail)
    return form.encode(reply), form.label(reply)
