"""Answer calls of ROS 2 services, and the node's own questions, by crux's own services."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Self

import zenoh

from hand_models.base import CruxError
from service.answering import SERVICES_BY_NAME
from service.replies import ErrorReply
from service.ros2.definitions import RosTypes
from service.ros2.messages import AnyReply, RosMessages, read_answer
from service.ros2.names import Attachment, Endpoint
from service.wire import Format, ServiceName, check_size, encode_error

__all__ = ["OwnQuestion", "RosCall", "RosQuestion", "ServiceCall"]


class RosQuestion(ABC):
    """Question for a caller by ROS 2, with the face of a zenoh query for crux.

    Use it in a ``with`` block, which ends the query.

    Attributes
    ----------
    caller : bytes
        Global identifier of the caller, 16 bytes.
    """

    caller: bytes

    @property
    @abstractmethod
    def payload(self) -> zenoh.ZBytes:
        """The request of crux, in JSON."""

    @property
    def encoding(self) -> zenoh.Encoding:
        """Encoding of the payload."""
        return zenoh.Encoding.APPLICATION_JSON

    @property
    def attachment(self) -> zenoh.ZBytes | None:
        """Secret by which a client proves its identifier: callers by ROS 2 have none."""
        return None

    @property
    def source_info(self) -> zenoh.SourceInfo | None:
        """Identifier of the client's session: callers by ROS 2 have one of their own."""
        return None

    @abstractmethod
    def reply(self, key: str, payload: bytes, *, encoding: str) -> None:
        """Take a reply, in JSON.

        Parameters
        ----------
        key : str
            Key of crux's own service.
        payload : bytes
            Encoded reply, in JSON.
        encoding : str
            Zenoh encoding of the payload.
        """

    @abstractmethod
    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        """Take an encoded `ErrorReply`."""

    def __enter__(self) -> Self:
        return self

    @abstractmethod
    def __exit__(self, *_: object) -> None: ...


class OwnQuestion(RosQuestion):
    """Question that the node asks by itself, for a caller by ROS 2.

    Parameters
    ----------
    caller : bytes
        Global identifier of the caller, 16 bytes.
    request : bytes
        The request of crux, in JSON.
    replied : callable
        Called with each reply in JSON, and its zenoh encoding.
    refused : callable
        Called with the error, if there is one.
    """

    def __init__(
        self,
        caller: bytes,
        request: bytes,
        replied: Callable[[bytes, str], None],
        refused: Callable[[ErrorReply], None],
    ) -> None:
        self.caller, self._payload = caller, zenoh.ZBytes(request)
        self._replied, self._refused = replied, refused

    @property
    def payload(self) -> zenoh.ZBytes:
        return self._payload

    def reply(self, key: str, payload: bytes, *, encoding: str) -> None:
        self._replied(payload, encoding)

    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        self._refused(Format.named(encoding).decode(payload, ErrorReply))

    def __exit__(self, *_: object) -> None:
        pass


class ServiceCall:
    """Call of a service of ROS 2, to be answered by one response.

    Parameters
    ----------
    query : zenoh.Query
        Query by which ROS 2 calls.
    key : str
        Key of the service.
    service : Endpoint
        The service that is called.
    types : RosTypes

    Attributes
    ----------
    caller : bytes
        Global identifier of the caller, 16 bytes.

    Raises
    ------
    InvalidInputError
        If the query has not the attachment of ROS 2.
    """

    def __init__(self, query: zenoh.Query, key: str, service: Endpoint, types: RosTypes) -> None:
        self._query, self._key, self.service, self._types = query, key, service, types
        given = query.attachment
        attached = Attachment.read(b"" if given is None else given.to_bytes())
        self._number, self.caller = attached.number, attached.sender

    def read(self, kind: type) -> Any:
        """Return the request.

        Parameters
        ----------
        kind : type
            Request of crux in it, which limits its bytes.

        Raises
        ------
        LimitError
            If the request has too many bytes.
        MalformedError
            If the request is not of the service's type.
        """
        given = self._query.payload
        data = b"" if given is None else given
        check_size(len(data), kind)
        return self._types.decode(bytes(data), f"{self.service.type}_Request")

    def respond(self, response: Any) -> None:
        """Send the response."""
        # whose request it answers
        attached = Attachment.sent_now(self._number, self.caller)
        self._query.reply(self._key, self._types.encode(response), attachment=attached.encode())

    def end(self) -> None:
        """End the query, which has then no further response."""
        self._query.drop()


class RosCall(RosQuestion):
    """Call of a ROS 2 service.

    The reply to it, or the error, becomes the response of the service: to ROS 2, an error reply of
    zenoh is no reply.

    Parameters
    ----------
    call : ServiceCall
    messages : RosMessages
    prepare : callable
        Called with the request of crux, in JSON; returns it as it is to be asked.
    answered : callable
        Called with the call and its reply, a typed message of crux, before the response is sent.
    """

    def __init__(
        self,
        call: ServiceCall,
        messages: RosMessages,
        prepare: Callable[[bytes], bytes],
        answered: Callable[[RosCall, AnyReply], None],
    ) -> None:
        self._call, self._messages = call, messages
        self._prepare, self._answered = prepare, answered
        self.caller = call.caller
        self._response = f"{call.service.type}_Response"
        self._payload = zenoh.ZBytes(b"")

    def read(self, name: ServiceName) -> None:
        """Read the request of the service, as crux's request of a kind.

        Raises
        ------
        LimitError
            If the request has too many bytes for its kind.
        MalformedError
            If the request is not of the service's type.
        """
        request = self._call.read(SERVICES_BY_NAME[name].request)
        self._payload = zenoh.ZBytes(self._prepare(self._messages.request(name, request)))

    @property
    def payload(self) -> zenoh.ZBytes:
        """The request of crux, in JSON; empty before it is read."""
        return self._payload

    def reply(self, key: str, payload: bytes, *, encoding: str) -> None:
        """Send a reply as the response of the service; parameters as of `RosQuestion.reply`."""
        reply = read_answer(payload, encoding)
        self._answered(self, reply)
        self._call.respond(self._messages.response(self._response, reply, payload.decode()))

    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        """Send an encoded `ErrorReply` as the response of the service."""
        error = Format.named(encoding).decode(payload, ErrorReply)
        self._call.respond(self._messages.refusal(self._response, error))

    def refuse(self, error: CruxError) -> None:
        """Send an error as the response of the service."""
        answer = encode_error(error, Format.JSON)
        self.reply_err(answer.payload, encoding=answer.encoding)

    def __exit__(self, *_: object) -> None:
        self._call.end()
