"""Answer calls of ROS 2 services by crux's own questions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self

import zenoh

from hand_models.base import CruxError
from service.answering import SERVICES_BY_NAME
from service.replies import ErrorReply
from service.ros2.messages import RosMessages
from service.ros2.names import Attachment, Endpoint
from service.wire import Format, ServiceName, check_size, encode_error

__all__ = ["RosCall"]


class RosCall:
    """Call of a ROS 2 service, with the face of a zenoh query for crux.

    The reply to it, or the error, becomes the response of the service: to ROS 2, an error reply of
    zenoh is no reply. Use it in a ``with`` block, which ends the query.

    Parameters
    ----------
    query : zenoh.Query
        Query by which ROS 2 calls.
    key : str
        Key of the service.
    service : Endpoint
        The service that is called.
    messages : RosMessages
    answered : callable
        Called with the response to a request that is answered, before it is sent.

    Raises
    ------
    InvalidInputError
        If the query has not the attachment of ROS 2.
    """

    def __init__(
        self,
        query: zenoh.Query,
        key: str,
        service: Endpoint,
        messages: RosMessages,
        answered: Callable[[Any], None],
    ) -> None:
        self._query, self._key, self._service, self._messages = query, key, service, messages
        self._answered = answered
        given = query.attachment
        self._attached = Attachment.read(b"" if given is None else given.to_bytes())
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
        given = self._query.payload
        if given is None:
            given = zenoh.ZBytes(b"")
        check_size(len(given), SERVICES_BY_NAME[name].request)
        request = self._messages.types.decode(given.to_bytes(), f"{self._service.type}_Request")
        self._payload = zenoh.ZBytes(self._messages.request(name, request))

    @property
    def payload(self) -> zenoh.ZBytes:
        """The request of crux, in JSON; empty before it is read."""
        return self._payload

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
        """Identifier of the client's session, as of the query."""
        return self._query.source_info

    def reply(self, key: str, payload: bytes, *, encoding: str) -> None:
        """Send a reply as the response of the service.

        Parameters
        ----------
        key : str
            Key of crux's own service, which is not that of the response.
        payload : bytes
            Encoded reply, in JSON.
        encoding : str
            Zenoh encoding of the payload.
        """
        response = self._messages.response(f"{self._service.type}_Response", payload)
        self._answered(response)
        self._send(response)

    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        """Send an encoded `ErrorReply` as the response of the service."""
        error = Format.named(encoding).decode(payload, ErrorReply)
        self._send(self._messages.refusal(f"{self._service.type}_Response", error))

    def refuse(self, error: CruxError) -> None:
        """Send an error as the response of the service."""
        answer = encode_error(error, Format.JSON)
        self.reply_err(answer.payload, encoding=answer.encoding)

    def _send(self, response: Any) -> None:
        # whose request it answers
        attached = Attachment.sent_now(self._attached.number, self._attached.sender)
        self._query.reply(
            self._key, self._messages.types.encode(response), attachment=attached.encode()
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._query.drop()
