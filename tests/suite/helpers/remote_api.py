"""A stand-in for zenoh's remote-api plugin: what zenoh-ts sends by WebSocket, on a real session.

It has the messages that a client needs that asks, publishes and subscribes; others are refused by
name. Their layout was read from the JavaScript of zenoh-ts 1.10.1; the plugin itself is not here.
"""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable
from typing import Any, Self

import zenoh
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

IDENTIFIED = 0x80
"""Bit of a message's first byte: an identifier follows, and a response with it is waited for."""

# what a client sends
DECLARE_PUBLISHER, DECLARE_SUBSCRIBER, PUBLISHER_PUT, GET, PING = 0, 2, 16, 18, 25

# what it gets
RESPONSE_PING, RESPONSE_OK, RESPONSE_ERROR, SAMPLE, REPLY, FINAL = 0, 1, 2, 5, 7, 8

ENCODINGS = {0: "zenoh/bytes", 1: "zenoh/string", 4: "text/plain", 5: "application/json"}
CUSTOM = 0xFFFF
"""Number of an encoding that has a name of its own, which is then its schema."""


class Reader:
    """Reads values in zenoh's serialisation, one after another."""

    def __init__(self, message: bytes) -> None:
        self.message, self.at = message, 0

    def number(self, form: str) -> int:
        (value,) = struct.unpack_from(f"<{form}", self.message, self.at)
        self.at += struct.calcsize(form)
        return int(value)

    def data(self) -> bytes:
        """Bytes with their length before them: seven bits in each byte, the lowest first."""
        length = shift = 0
        while True:
            part = self.number("B")
            length |= (part & 0x7F) << shift
            shift += 7
            if part < IDENTIFIED:
                break
        self.at += length
        return self.message[self.at - length : self.at]

    def text(self) -> str:
        return self.data().decode()

    def optional(self, read: Callable[[], Any]) -> Any:
        return read() if self.number("B") else None

    def encoding(self) -> zenoh.Encoding:
        number, schema = self.number("H"), self.text()
        if number == CUSTOM:
            return zenoh.Encoding(schema)
        plain = zenoh.Encoding(ENCODINGS[number])
        return plain.with_schema(schema) if schema else plain


def data(value: bytes) -> bytes:
    head, length = bytearray(), len(value)
    while length > 0x7F:
        head.append(length & 0x7F | IDENTIFIED)
        length >>= 7
    return bytes(head) + bytes([length]) + value


def encoding(label: zenoh.Encoding) -> bytes:
    name, _, schema = str(label).partition(";")
    for number, known in ENCODINGS.items():
        if name == known:
            return struct.pack("<H", number) + data(schema.encode())
    return struct.pack("<H", CUSTOM) + data(str(label).encode())


def sample_bytes(sample: zenoh.Sample) -> bytes:
    """Return a sample without attachment and time, which the service has none of."""
    kind = sample.kind == zenoh.SampleKind.DELETE
    qos = 5 | 1 << 3 | 1 << 5 | 2 << 6  # priority of data, blocks, reliable, anywhere
    parts = (
        data(str(sample.key_expr).encode()),
        data(sample.payload.to_bytes()),
        bytes([kind]),
        encoding(sample.encoding),
        bytes([False, False, qos]),
    )
    return b"".join(parts)


class Client:
    """One WebSocket, and the declarations that came by it."""

    def __init__(self, session: zenoh.Session, socket: ServerConnection) -> None:
        self.session, self.socket = session, socket
        self.publishers: dict[int, zenoh.Publisher] = {}
        self.subscribers: list[Any] = []
        self.sending = threading.Lock()

    def send(self, kind: int, *parts: bytes, identifier: int | None = None) -> None:
        head = bytes([kind])
        if identifier is not None:
            head = struct.pack("<BI", kind | IDENTIFIED, identifier)
        try:
            with self.sending:
                self.socket.send(head + b"".join(parts))
        except ConnectionClosed:
            pass  # a client that is gone needs nothing

    def serve(self) -> None:
        try:
            for message in self.socket:
                assert isinstance(message, bytes)
                self.take(Reader(message))
        except ConnectionClosed:
            pass  # without a close frame
        finally:
            for declared in (*self.publishers.values(), *self.subscribers):
                declared.undeclare()

    def take(self, message: Reader) -> None:
        kind = message.number("B")
        if not kind & IDENTIFIED:
            {GET: self.get, PUBLISHER_PUT: self.put}[kind](message)
            return
        identifier, kind = message.number("I"), kind & ~IDENTIFIED
        if kind == PING:
            name = str(self.session.zid()).encode()
            self.send(RESPONSE_PING, data(name), identifier=identifier)
        elif kind in (DECLARE_PUBLISHER, DECLARE_SUBSCRIBER):
            own, key = message.number("I"), message.text()
            if kind == DECLARE_PUBLISHER:
                label = message.encoding()
                self.publishers[own] = self.session.declare_publisher(key, encoding=label)
            else:
                self.subscribe(own, key)
            self.send(RESPONSE_OK, bytes([kind]), identifier=identifier)
        else:
            missing = f"message {kind} is not of this stand-in".encode()
            self.send(RESPONSE_ERROR, data(missing), identifier=identifier)

    def subscribe(self, own: int, key: str) -> None:
        def came(sample: zenoh.Sample) -> None:
            self.send(SAMPLE, struct.pack("<I", own), sample_bytes(sample))

        self.subscribers.append(self.session.declare_subscriber(key, came))

    def put(self, message: Reader) -> None:
        publisher, payload = self.publishers[message.number("I")], message.data()
        publisher.put(payload, encoding=message.optional(message.encoding))

    def get(self, message: Reader) -> None:
        asked = struct.pack("<I", message.number("I"))
        key, parameters = message.text(), message.text()
        payload = message.optional(message.data)
        label = message.optional(message.encoding)
        message.optional(message.data)  # an attachment
        message.number("H")  # how the query travels, and who is to answer
        replies = self.session.get(
            f"{key}?{parameters}" if parameters else key,
            payload=payload,
            encoding=label,
            timeout=message.number("I") / 1e3,
        )
        threading.Thread(target=self.answer, args=(asked, replies), daemon=True).start()

    def answer(self, asked: bytes, replies: Any) -> None:
        for reply in replies:
            if reply.ok is not None:
                self.send(REPLY, asked, bytes([True]), sample_bytes(reply.ok))
            else:
                payload, label = reply.err.payload.to_bytes(), encoding(reply.err.encoding)
                self.send(REPLY, asked, bytes([False]), data(payload), label)
        self.send(FINAL, asked)


class RemoteApi:
    """Serves WebSockets at ``locator`` for a session, in a ``with`` block."""

    def __init__(self, session: zenoh.Session) -> None:
        def serve_client(socket: ServerConnection) -> None:
            Client(session, socket).serve()

        self.server: Server = serve(serve_client, "127.0.0.1", 0, max_size=None)
        self.locator = f"ws/127.0.0.1:{self.server.socket.getsockname()[1]}"

    def __enter__(self) -> Self:
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.server.shutdown()
