"""Encode messages as JSON or MessagePack, and decode and validate requests."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from enum import Enum
from functools import partial
from typing import Any, Final, NamedTuple, TypeVar

import msgspec

from hand_models.base import CruxError, InvalidInputError, UnsupportedError
from service.replies import ErrorDetail, ErrorReply
from service.requests import Identifier, ReplyBytes
from service.wire.duplicate_keys import refuse_in_json, refuse_in_msgpack
from service.wire.errors import BusyError, MalformedError
from service.wire.sizes import LARGEST_REQUEST, check_size, most_bytes
from service.wire.validation_errors import validation_error

__all__ = [
    "LARGEST_ERROR",
    "Answer",
    "Format",
    "decode_request",
    "encode_error",
    "identifier",
    "most_error_bytes",
]

MessageT = TypeVar("MessageT")

LARGEST_ERROR: Final = 4096
"""Maximum bytes of an error reply."""


LATER_FIELDS: Final = {"confidence": "leave it out: tile limits are nominal"}
"""Request fields that this version does not support, each with advice for the error message."""


_known: set[object] = set()
_first_decoding = threading.Lock()


class Format(Enum):
    """Encoding of a message, JSON or MessagePack; the enum's value is the media type."""

    JSON = "application/json"
    MSGPACK = "application/msgpack"

    @classmethod
    def named(cls, encoding: str) -> Format:
        """Return the format that a zenoh encoding names; a schema after a semicolon is ignored.

        Parameters
        ----------
        encoding : str
            Name such as ``application/json;crux.PlanReply@1``. An empty name, and zenoh's default
            ``zenoh/bytes``, mean JSON.

        Raises
        ------
        MalformedError
            If the encoding is neither JSON nor MessagePack.
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
        """Return the zenoh encoding of a message with its schema: ``…/json;crux.PlanReply@1``."""
        return f"{self.value};{_schema_name(type(message))}"

    @staticmethod
    def is_labelled(encoding: str, kind: type[msgspec.Struct]) -> bool:
        """Return True if a zenoh encoding names the schema of a given message type."""
        return encoding.partition(";")[2] == _schema_name(kind)

    def encode(self, message: object) -> bytes:
        """Encode a message as bytes in this format."""
        if self is Format.JSON:
            return msgspec.json.encode(message)
        return msgspec.msgpack.encode(message)

    def decode(self, payload: bytes, kind: type[MessageT]) -> MessageT:
        """Decode bytes of this format into a message.

        Parameters
        ----------
        payload : bytes
            Encoded message.
        kind : type
            Message type to return.

        Raises
        ------
        msgspec.ValidationError
            If the bytes are of this format, but do not match the message type.
        MalformedError
            If the bytes are empty, or not of this format.
        """
        if not payload:
            raise MalformedError(f"empty: nothing was sent, a {kind.__name__} is needed")
        if kind not in _known:
            # of two threads that are the first to decode a type, one crashes (msgspec 0.22)
            with _first_decoding:
                msgspec.msgpack.Decoder(kind)
                _known.add(kind)
        try:
            if self is Format.JSON:
                return msgspec.json.decode(payload, type=kind)
            return msgspec.msgpack.decode(payload, type=kind)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            other = self._contradicted(payload)
            # MessagePack reads the first letter of JSON as a number
            if isinstance(error, msgspec.ValidationError) and other is None:
                raise
            said = f"not valid {self.name}: {error}" if other is None else other
            raise MalformedError(said) from None
        except RecursionError:
            raise _too_deep() from None

    def _contradicted(self, payload: bytes) -> str | None:
        """Return that bytes look like the other format; None if they do not.

        Every message is an object: in JSON it begins with a brace, in MessagePack with the byte of
        a map.
        """
        first = payload.lstrip()[:1]
        looks = None
        if first in (b"{", b"["):
            looks = Format.JSON
        elif payload[0] in range(0x80, 0x90) or payload[0] in (0xDE, 0xDF):
            looks = Format.MSGPACK
        if looks in (None, self):
            return None
        words = {Format.JSON: "JSON", Format.MSGPACK: "MessagePack"}
        return (
            f"the encoding says {words[self]}; the bytes look like {words[looks]}: send "
            f"{words[self]}, or say {looks.value}"
        )


def _too_deep() -> MalformedError:
    return MalformedError(
        "has lists or objects nested too deep to be read, hundreds of levels; a request needs a "
        "few: remove the extra brackets"
    )


def _schema_name(kind: type[msgspec.Struct]) -> str:
    return f"crux.{kind.__name__}@1"


class Answer(NamedTuple):
    """Answer to a client: an encoded reply, or an encoded error reply.

    Attributes
    ----------
    payload : bytes
        Encoded reply.
    encoding : str
        Zenoh encoding of the payload, with its schema.
    good : bool
        True for a reply, false for an error reply.
    status : str
        Status of the reply, such as ``optimal``, or ``done`` for a reply without one; for an error
        reply the kind of error.
    seconds : float
        Wall-clock time that the answer took [s].
    cost : float
        Processor time that the answer took [s]; other programs on the machine do not change it.
    last : bool
        False for a part of the answer, which more replies to the query follow.
    streams : tuple of str or None
        Streams that are kept once one has been declared; None for other answers.
    """

    payload: bytes
    encoding: str
    good: bool = True
    status: str = "done"
    seconds: float = 0.0
    cost: float = 0.0
    last: bool = True
    streams: tuple[str, ...] | None = None


def decode_request(payload: bytes, kind: type[MessageT], form: Format = Format.JSON) -> MessageT:
    """Decode and validate a request, with every check that does not need a hand model.

    The checks are: size, encoding, field types and bounds, finite numbers, repeated keys, and
    fields that this version does not support.

    Parameters
    ----------
    payload : bytes
        Encoded request.
    kind : type
        Request type to return.
    form : Format, optional
        Encoding of the payload.

    Raises
    ------
    InvalidInputError
        If the request is invalid. The error names the field, and is a `LimitError`,
        `MalformedError` or `UnsupportedError` where one of these applies.
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
        raise InvalidInputError(message, field=field) from None
    try:
        if form is Format.JSON:
            refuse_in_json(payload)
        else:
            refuse_in_msgpack(payload)
        _check(request)
    except RecursionError:
        raise _too_deep() from None
    return request


def _check(value: object) -> None:
    """Check a decoded request, or a part of it, beyond its types; errors have the path from there.

    Raises
    ------
    InvalidInputError
        If a number is not finite.
    UnsupportedError
        If a field has a value that this version does not support.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InvalidInputError(f"must be a finite number, got {value}")
        return
    names: Sequence[object] | None = None
    parts: Iterable[object] = ()
    if isinstance(value, msgspec.Struct):
        # a mesh's model checks its long lists of numbers as arrays
        fields = [name for name in value.__struct_fields__ if name not in ("vertices", "faces")]
        names, parts = fields, [getattr(value, name) for name in fields]
        for name in LATER_FIELDS.keys() & fields:
            if getattr(value, name) is not None:
                error = UnsupportedError(f"not supported in this version; {LATER_FIELDS[name]}")
                raise error.within(name)
    elif isinstance(value, (list, tuple)):
        parts = value
    elif isinstance(value, Mapping):
        names, parts = list(value), value.values()
    for i, part in enumerate(parts):
        # most parts: there are hundreds
        if part is None or isinstance(part, (str, int)):
            continue
        try:
            _check(part)
        except InvalidInputError as error:
            raise error.within(f"[{i}]" if names is None else str(names[i])) from None


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
    """Return a request's ``id``, also if the rest of the request is invalid.

    Parameters
    ----------
    payload : bytes
        Encoded request, in the format ``form``.
    form : Format
    kind : type, optional
        Request type, whose maximum of bytes applies; by default `LARGEST_REQUEST`.

    Returns
    -------
    str or None
        None if the request has no ``id``, cannot be decoded, or is too large.
    """
    read = _part(payload, form, kind, _Named)
    return None if read is None else read.id


def most_error_bytes(payload: bytes, form: Format, kind: type | None = None) -> int:
    """Return the maximum bytes of an error reply to a request; parameters as for `identifier`.

    This is the request's ``max_reply_bytes``, but at most `LARGEST_ERROR`.
    """
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
    """Encode an error as an error reply, with texts cut to fit a maximum of bytes.

    Parameters
    ----------
    error : CruxError
        Error with kind, message and field.
    form : Format
        Encoding of the reply.
    name : str, optional
        The request's ``id``, which the reply repeats.
    kind : str, optional
        Kind of error in the reply; by default the kind of ``error``.
    most : int, optional
        Maximum bytes of the reply, at least `service.requests.LEAST_REPLY_BYTES`.
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
