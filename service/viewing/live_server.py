"""HTTP server of a live page: on this machine alone, for those alone who have its address."""

from __future__ import annotations

import contextlib
import hmac
import secrets
import socket
import sys
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.client import HTTP_PORT
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs

import msgspec

from hand_models.base import CruxError, InvalidInputError, Strict
from hand_models.hand import FINGERS
from service import wire
from service.viewing.followed_streams import FollowedStreams
from service.viewing.live_plan import LivePlan
from service.viewing.moved_stance import StanceMoves
from service.viewing.settings import VIEWING_SETTINGS

__all__ = ["LiveServer"]


class _Question(Strict, frozen=True):
    """Question of the page: moves, whether the mouse is still moving, what was seen of streams."""

    moves: StanceMoves = StanceMoves()
    brief: bool = False
    count: int = 0


class _RefusedError(Exception):
    """Request that is not answered.

    Parameters
    ----------
    status : HTTPStatus
    message : str
        Why, for a person.
    """

    def __init__(self, status: HTTPStatus, message: str) -> None:
        super().__init__(message)
        self.status = status


class LiveServer(ThreadingHTTPServer):
    """Server of one live page at 127.0.0.1, whose address has a secret token.

    It answers only requests with the token that name this machine as their host, as those of a
    page of another site do not; questions have to come from the page itself. Each connection has
    a thread; beyond `ViewingSettings.most_connections` others are refused with status 503.

    Parameters
    ----------
    plan : LivePlan
    port : int
        0 for any that is free.
    streams : FollowedStreams, optional
        Streams that the page follows.

    Attributes
    ----------
    address : str
        Address of the page, with the token.

    Raises
    ------
    OSError
        If the port is taken.
    """

    daemon_threads = True
    request_queue_size = VIEWING_SETTINGS.most_waiting

    def __init__(self, plan: LivePlan, port: int, streams: FollowedStreams | None = None) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.token = secrets.token_urlsafe(24)
        ending = "" if self.server_port == HTTP_PORT else f":{self.server_port}"
        self.hosts = {f"{name}{ending}" for name in ("127.0.0.1", "localhost")}
        self.address = f"http://127.0.0.1:{self.server_port}/?token={self.token}"
        self.follows = streams is not None
        self._plan, self._streams = plan, streams
        self._free = threading.BoundedSemaphore(VIEWING_SETTINGS.most_connections)
        self.answers: Mapping[str, Callable[[_Question], Any]] = {
            "/plan": lambda asked: plan.plan(asked.moves, brief=asked.brief),
            "/advice": lambda asked: plan.advice(asked.moves),
            "/save": lambda asked: plan.save(asked.moves),
            "/follow": self._follow,
        }

    def document(self) -> str:
        """Return the page."""
        return self._plan.document(follows=self.follows, fingers=FINGERS)

    def _follow(self, asked: _Question) -> dict[str, Any]:
        if self._streams is None:
            raise InvalidInputError("no stream is followed; start crux view with --follow")
        return self._streams.after(asked.count, VIEWING_SETTINGS.longest_wait)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own, or refuse it where there are too many."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
            return
        words = b"crux view has too many connections; close other pages, and try again\n"
        head = "HTTP/1.1 503 Service Unavailable\r\nRetry-After: 1\r\nConnection: close\r\n"
        head += f"Content-Type: text/plain; charset=utf-8\r\nContent-Length: {len(words)}\r\n\r\n"
        with contextlib.suppress(OSError):  # who is gone, or does not read
            request.setblocking(False)
            request.send(head.encode() + words)
            request.shutdown(socket.SHUT_WR)
            request.recv(VIEWING_SETTINGS.most_bytes)  # what is not read would reset the connection
        self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a connection until it ends."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a browser that is gone; raise what is a fault of this program."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers one connection."""

    server: LiveServer
    protocol_version = "HTTP/1.1"
    timeout = VIEWING_SETTINGS.first_timeout
    disable_nagle_algorithm = True  # the body would wait for the receipt of the head, for 40 ms

    def do_GET(self) -> None:
        try:
            path, _, query = self.path.partition("?")
            self._check(path == "/", parse_qs(query).get("token", [""])[0])
            self._send(HTTPStatus.OK, self.server.document().encode(), "text/html; charset=utf-8")
        except _RefusedError as error:
            self._refuse(error)
        except CruxError as error:
            self._refuse(_RefusedError(HTTPStatus.BAD_REQUEST, str(error)))

    def do_POST(self) -> None:
        try:
            answer = self.server.answers.get(self.path)
            self._check(answer is not None, self.headers.get("X-Crux-Token", ""))
            assert answer is not None  # checked
            self._check_origin()
            content = {"answer": answer(wire.decode_request(self._body(), _Question))}
        except _RefusedError as error:
            self._refuse(error)
            return
        except CruxError as error:
            content = {"error": str(error)}
        except Exception:
            words = "crux view has failed on this; its output in the terminal says where"
            self._refuse(_RefusedError(HTTPStatus.INTERNAL_SERVER_ERROR, words))
            raise
        self._send(HTTPStatus.OK, msgspec.json.encode(content), "application/json")

    def _check(self, known: bool, token: str) -> None:
        """Raise unless the request is for this server, from somebody who has the page's address."""
        if self.headers.get("Host", "") not in self.server.hosts:
            raise _RefusedError(
                HTTPStatus.FORBIDDEN, "this address is not that which crux view has printed"
            )
        if not hmac.compare_digest(token.encode(), self.server.token.encode()):
            raise _RefusedError(
                HTTPStatus.FORBIDDEN,
                "the token is missing or wrong: open the whole address that crux view has printed",
            )
        self.connection.settimeout(VIEWING_SETTINGS.socket_timeout)
        if not known:
            raise _RefusedError(HTTPStatus.NOT_FOUND, "there is nothing at this address")

    def _check_origin(self) -> None:
        """Raise unless a question comes from the page itself."""
        if self.headers.get("Origin") != f"http://{self.headers['Host']}":
            raise _RefusedError(HTTPStatus.FORBIDDEN, "questions of other pages are not answered")

    def _body(self) -> bytes:
        """Return the body of a question, which is bounded."""
        length, most = self.headers.get("Content-Length", ""), VIEWING_SETTINGS.most_bytes
        if not length.isdecimal() or "Transfer-Encoding" in self.headers:
            raise _RefusedError(HTTPStatus.LENGTH_REQUIRED, "the body's length is missing")
        if len(length) > 9 or int(length) > most:
            raise _RefusedError(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a question has {most} bytes at most"
            )
        return self.rfile.read(int(length))

    def _refuse(self, error: _RefusedError) -> None:
        self.close_connection = True  # its body is not read
        self._send(error.status, f"{error}\n".encode(), "text/plain; charset=utf-8")

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in {
            "Content-Type": kind,
            "Content-Length": str(len(content)),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Content-Security-Policy": "default-src 'none'; script-src 'unsafe-inline'; "
            "style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self' data:; "
            "frame-ancestors 'none'",
        }.items():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: Any) -> None:
        """Write no line for each request."""
