"""Encode and decode messages as JSON or MessagePack, named by a zenoh encoding."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from enum import Enum
from functools import partial
from typing import Any, Final, NamedTuple, TypeVar, get_args

import msgspec

from hand_models.base import CruxError, InvalidInputError, LimitError, UnsupportedError
from planner import Objective
from service.replies import ErrorDetail, ErrorReply
from service.requests import Identifier, ReplyBytes, SetPointsRequest, StreamRequest
from service.wire.duplicate_keys import refuse_in_json, refuse_in_msgpack
from service.wire.errors import BusyError, MalformedError
from service.wire.validation_errors import validation_error

__all__ = [
    "LARGEST_ERROR",
    "LARGEST_REQUEST",
    "Answer",
    "Format",
    "check_size",
    "decode_request",
    "encode_error",
    "identifier",
    "most_bytes",
    "most_error_bytes",
]

MessageT = TypeVar("MessageT")

LARGEST_REQUEST: Final = 2**26
"""Most bytes of a request; a stance takes a few thousand, a scan of 200,000 triangles about 10⁷."""

LARGEST_ERROR: Final = 4096
"""Most bytes of an error reply."""


LATER_FIELDS: Final = {"confidence": "leave it out: tile limits are nominal"}
"""Fields of later versions, with the advice for a request that has them."""


class Format(Enum):
    """Format of a message; the value is its encoding."""

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
        if plain in {"", "zenoh/bytes", "text/json"}:
            return cls.JSON
        try:
            return cls(plain)
        except ValueError:
            raise MalformedError(
                f"unknown encoding {plain[:80]!r}; valid: {', '.join(f.value for f in cls)}"
            ) from None

    def label(self, message: msgspec.Struct) -> str:
        """Return the encoding of a message with its schema, as in ``…/json;crux.PlanReply@1``."""
        return f"{self.value};{_schema_name(type(message))}"

    @staticmethod
    def is_labelled(encoding: str, kind: type[msgspec.Struct]) -> bool:
        """Return whether an encoding names the schema of a kind of message."""
        return encoding.partition(";")[2] == _schema_name(kind)

    def encode(self, message: object) -> bytes:
        """Return a message as bytes."""
        if self is Format.JSON:
            return msgspec.json.encode(message)
        return msgspec.msgpack.encode(message)

    def decode(self, payload: bytes, kind: type[MessageT]) -> MessageT:
        """Return bytes as a message.

        Raises
        ------
        msgspec.ValidationError
            If the bytes are another message.
        MalformedError
            If the bytes are no message.
        """
        if not payload:
            raise MalformedError(f"empty: nothing was sent, a {kind.__name__} is needed")
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


def _schema_name(kind: type[msgspec.Struct]) -> str:
    return f"crux.{kind.__name__}@1"


class Answer(NamedTuple):
    """Answer to the caller: a reply, or an error.

    Attributes
    ----------
    payload : bytes
    encoding : str
        Encoding of the payload, with its schema.
    good : bool
        True for a reply, false for an error.
    status : str
        Status of a reply that has one; the kind of an error.
    seconds : float
        Duration of the work [s].
    cost : float
        Processor time of it [s], which other programs on the machine do not change.
    """

    payload: bytes
    encoding: str
    good: bool = True
    status: str = "done"
    seconds: float = 0.0
    cost: float = 0.0


def decode_request(payload: bytes, kind: type[MessageT], form: Format = Format.JSON) -> MessageT:
    """Return bytes as a request that has passed every check which needs no model.

    Raises
    ------
    InvalidInputError
        With the field to blame; as `MalformedError` or `UnsupportedError` where that is the case.
    """
    check_size(len(payload), kind)
    try:
        request = form.decode(payload, kind)
    except msgspec.ValidationError as error:
        if form is Format.MSGPACK and "Expected `float`" in str(error):
            # a number that is not finite breaks every bound
            with suppress(RecursionError):
                _check(_plain(payload, form))
        field, message = validation_error(
            error,
            kind,
            partial(_plain, payload, form),
            lambda part: form.decode(form.encode(part), kind),
        )
        if field == "objective" and "value 'max_reliability'" in str(error):
            raise UnsupportedError(
                "max_reliability is not supported in this version; valid are "
                f"{' and '.join(get_args(Objective))}",
                field=field,
            ) from None
        raise InvalidInputError(message, field=field) from None
    try:
        if form is Format.JSON:
            refuse_in_json(payload)
        else:
            refuse_in_msgpack(payload)
        _check(request)
    except RecursionError:
        raise MalformedError("nested too deeply") from None
    return request


def _check(value: object, path: str = "") -> None:
    """Check a decoded request, or a part of it, beyond its types.

    Raises
    ------
    InvalidInputError
        If a number is not finite.
    UnsupportedError
        If a field has a value that this version does not support.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InvalidInputError(f"must be a finite number, got {value}", field=path)
    elif isinstance(value, msgspec.Struct):
        for name in value.__struct_fields__:
            part, field = getattr(value, name), f"{path}.{name}" if path else name
            if name in LATER_FIELDS and part is not None:
                raise UnsupportedError(
                    f"not supported in this version; {LATER_FIELDS[name]}", field=field
                )
            # a mesh's model checks its long lists of numbers as arrays
            if name not in {"vertices", "faces"}:
                _check(part, field)
    elif isinstance(value, Mapping):
        for name, part in value.items():
            _check(part, f"{path}.{name}" if path else str(name))
    elif isinstance(value, (list, tuple)):
        for i, part in enumerate(value):
            _check(part, f"{path}[{i}]")


def most_bytes(kind: type) -> int:
    """Return the most bytes of a request of a kind; a larger one is not decoded."""
    if kind is SetPointsRequest:
        # it has no rock
        return 2**12
    if kind is StreamRequest:
        # streams are kept: sixteen of them have to fit into one process
        return 2**24
    return LARGEST_REQUEST


def check_size(size: int, kind: type) -> None:
    """Refuse a payload of too many bytes.

    Raises
    ------
    LimitError
        If a request of that kind may not have so many.
    """
    most = most_bytes(kind)
    if size > most:
        advice = (
            "ask for one body wrench at a time, with a shorter id"
            if kind is SetPointsRequest
            else "let hands share a scan under stance.rocks, cut it to what is near them, or make "
            "its triangles larger (crux rock --spacing)"
        )
        raise LimitError(f"{size} bytes; a {kind.__name__} may have {most} at most: {advice}")


def _plain(payload: bytes, form: Format) -> Any:
    """Return bytes as plain lists and dicts, or None for bytes that are no message."""
    try:
        return form.decode(payload, Any)
    except (MalformedError, msgspec.ValidationError):
        return None


class _Named(msgspec.Struct):
    id: Identifier | None = None


class _Bounded(msgspec.Struct):
    max_reply_bytes: ReplyBytes | None = None


def identifier(payload: bytes, form: Format, kind: type | None = None) -> str | None:
    """Return a request's ``id``, also of an invalid request; None if it cannot be read.

    It is not read from a payload that is too large for the kind of request.
    """
    read = _part(payload, form, kind, _Named)
    return None if read is None else read.id


def most_error_bytes(payload: bytes, form: Format, kind: type | None = None) -> int:
    """Return how many bytes an error reply to a request may take; parameters as `identifier`."""
    read = _part(payload, form, kind, _Bounded)
    most = None if read is None else read.max_reply_bytes
    return LARGEST_ERROR if most is None else min(most, LARGEST_ERROR)


def _part(payload: bytes, form: Format, kind: type | None, part: type[MessageT]) -> MessageT | None:
    if len(payload) > (LARGEST_REQUEST if kind is None else most_bytes(kind)):
        return None
    try:
        return form.decode(payload, part)
    except (MalformedError, msgspec.ValidationError):
        return None


def encode_error(
    error: CruxError,
    form: Format,
    name: str | None = None,
    kind: str | None = None,
    most: int = LARGEST_ERROR,
) -> Answer:
    """Return an error reply as an answer.

    Texts are cut if the reply would have more than `LARGEST_ERROR` bytes, or more than the
    caller allows.

    Parameters
    ----------
    error : CruxError
    form : Format
    name : str, optional
        The request's ``id``.
    kind : str, optional
        Kind in the reply; by default the error's own.
    most : int, optional
        Bytes that it may take, at least `service.requests.LEAST_REPLY_BYTES`.
    """
    status = error.kind if kind is None else kind
    # most encoded bytes of each text; every id that a request may have fits
    parts = {"id": 1540, "field": 600, "message": 1600}
    reply = _error_reply(error, form, name, status, parts)
    payload = form.encode(reply)
    if len(payload) > most:
        # without these texts, it has 200 bytes at most
        share = (most - 200) / sum(parts.values())
        parts = {part: int(share * size) for part, size in parts.items()}
        reply = _error_reply(error, form, name, status, parts)
        payload = form.encode(reply)
    return Answer(payload, form.label(reply), False, status)


def _error_reply(
    error: CruxError, form: Format, name: str | None, status: str, parts: Mapping[str, int]
) -> ErrorReply:
    """Return an error reply whose texts take at most so many bytes."""
    detail = ErrorDetail(
        status,
        None if error.field is None else _cut(error.field, parts["field"], form),
        _cut(error.message, parts["message"], form),
    )
    if isinstance(error, BusyError):
        detail.retry_after = error.retry_after
    return ErrorReply(id=None if name is None else _cut(name, parts["id"], form), error=detail)


def _cut(text: str, most: int, form: Format) -> str:
    """Return a text, cut to at most so many bytes."""
    whole = text.encode(errors="replace").decode()  # half a pair of UTF-16 cannot be written
    if len(form.encode(whole)) <= most:
        return whole
    end = "…"
    beginning = whole[:most]
    while len(form.encode(beginning + end)) > most:
        beginning = beginning[: len(beginning) * 9 // 10]
    return beginning + end
