"""Check what a service needs of its machine, without starting the service."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from hand_models.base import InvalidInputError, to_install

__all__ = ["check_endpoints", "check_recording"]


def check_endpoints(endpoints: Iterable[str], metrics_port: int | None = None) -> None:
    """Check that a service could listen; endpoints of TCP, TLS, QUIC and UDP are tried.

    Parameters
    ----------
    endpoints : iterable of str
        Zenoh endpoints, such as ``tcp/127.0.0.1:7447``.
    metrics_port : int, optional
        Port for metrics on 127.0.0.1.

    Raises
    ------
    InvalidInputError
        If an address is in use, or is not this machine's.
    """
    listens = "give another with --listen, or as listen/endpoints in the file that says so"
    tried = [(endpoint, "--listen", listens) for endpoint in endpoints]
    if metrics_port is not None:
        tried.append((f"tcp/127.0.0.1:{metrics_port}", "--metrics-port", "give another"))
    for endpoint, option, advice in tried:
        protocol, _, rest = endpoint.partition("/")
        host, _, port = rest.partition("?")[0].partition("#")[0].rpartition(":")
        if protocol not in {"tcp", "tls", "quic", "udp"}:
            continue
        stream = protocol in {"tcp", "tls"}
        kind = socket.SOCK_STREAM if stream else socket.SOCK_DGRAM
        try:
            # of several addresses of a name, zenoh takes the first
            family, _, _, _, address = socket.getaddrinfo(host.strip("[]"), int(port), type=kind)[0]
            with socket.socket(family, kind) as probe:
                # as zenoh does: a port that was in use a moment ago can be had again
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, stream)
                probe.bind(address)
                if stream:
                    probe.listen(1)
        except OSError as error:
            message = f"{endpoint} cannot be opened: {error.strerror or error}; {advice}"
            raise InvalidInputError(message, field=option) from None


def check_recording(path: Path) -> None:
    """Check that a recording could be written.

    Raises
    ------
    InvalidInputError
        If the library mcap is not installed, or there is no folder in which a file can be made.
    """
    if find_spec("mcap") is None:
        message = f"needs mcap, which is not installed: {to_install('record')}"
        raise InvalidInputError(message, field="--record")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        message = f"cannot write {path}: no folder {path.parent} in which files can be made"
        raise InvalidInputError(message, field="--record")
