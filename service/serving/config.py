"""Make zenoh configurations from command-line flags, and open and close zenoh sessions."""

from __future__ import annotations

import logging
import os
import re
import socket
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from ipaddress import ip_address
from pathlib import Path
from typing import Final

import msgspec
import zenoh

from hand_models.base import InvalidInputError
from service.servers import first_line, open_session
from service.wire import LARGEST_REQUEST

__all__ = [
    "SESSION_MODES",
    "closed",
    "ended_in_time",
    "exposed",
    "listening",
    "open_session",
    "start_zenoh_log",
    "zenoh_config",
]

log = logging.getLogger(__name__)

SESSION_MODES: Final = ("peer", "client", "router")


def own_settings() -> dict[str, object]:
    """Return the zenoh settings that ``crux`` changes unless a configuration file sets them.

    Returns
    -------
    dict of str to object
        Value by zenoh key: largest message, what happens to replies on a full link, and for how
        long a message waits for a client that does not read.
    """
    queue = "transport/link/tx/queue/congestion_control"
    # [µs] a message waits so long for a client that takes nothing; then a reply is given up, and
    # for what cannot be given up, such as a declaration, the link is closed. In it a link of
    # 1 Mbit/s takes a batch. Zenoh's own 5 s hold up what others need
    client_reads = 1_000_000
    return {
        # a request, what it is sent with, and some to spare; zenoh's own limit is 1 GiB, of which a
        # session keeps every byte
        "transport/link/rx/max_message_size": LARGEST_REQUEST + 2**20,
        # a reply is sent as its query came, which is the client's choice; this makes it ours
        "qos/network": [
            {
                "messages": ["query"],
                "key_exprs": ["**/crux/**"],
                "flows": ["ingress"],
                "overwrite": {"congestion_control": "drop"},
            }
        ],
        f"{queue}/drop/wait_before_drop": client_reads,
        # [µs] all further parts of a large reply wait so long in sum. Beyond the 2 to 4 MB that the
        # system takes at once, a link of 10 Mbit/s takes 6 MB in it
        f"{queue}/drop/max_wait_before_drop_fragments": 5_000_000,
        f"{queue}/block/wait_before_close": client_reads,
    }


def zenoh_config(
    *,
    mode: str | None = None,
    connect: Sequence[str] = (),
    listen: Sequence[str] = (),
    file: Path | None = None,
    settings: Sequence[str] = (),
    multicast: bool = True,
) -> zenoh.Config:
    """Return a zenoh configuration made of a file, ``crux``'s defaults and command-line flags.

    Parameters
    ----------
    mode : {'peer', 'client', 'router'}, optional
        Mode of the session; by default the file's, or zenoh's.
    connect, listen : sequence of str, optional
        Endpoints to connect to and to listen on, such as ``tcp/127.0.0.1:7447``.
    file : Path, optional
        JSON5 configuration to start from; by default the file that the environment variable
        ``ZENOH_CONFIG`` names, if it is set.
    settings : sequence of str, optional
        Settings as ``KEY:VALUE``, with JSON5 values; these override all other sources.
    multicast : bool, optional
        True to let zenoh search for other sessions by multicast, if the file allows multicast.

    Raises
    ------
    InvalidInputError
        If the file cannot be read, or zenoh does not accept a value; ``field`` names the flag.
    """
    config, plain = _read(file), zenoh.Config()
    for key, own in own_settings().items():
        if config.get_json(key) == plain.get_json(key):
            _insert(config, key, _json(own), key)
    # queries through shared memory can be dropped unseen (zenoh issue 2628)
    _insert(config, "transport/shared_memory/enabled", "false", "shared_memory")
    if mode is not None:
        _insert(config, "mode", _json(mode), "--mode")
    for endpoints, key, flag in (
        (connect, "connect/endpoints", "--connect"),
        (listen, "listen/endpoints", "--listen"),
    ):
        if endpoints:
            for endpoint in endpoints:
                _must_be_endpoint(endpoint, flag)
            _insert(config, key, _json(list(endpoints)), flag)
    if not multicast:
        _insert(config, "scouting/multicast/enabled", "false", "--no-multicast-scouting")
    for setting in settings:
        key, colon, value = setting.partition(":")
        if not colon:
            raise InvalidInputError(
                f"KEY:VALUE is needed, such as mode:'client', got {setting!r}", field="--cfg"
            )
        _insert(config, key, value, "--cfg")
    return config


@contextmanager
def ended_in_time(session: zenoh.Session) -> Iterator[zenoh.Session]:
    """Return a context manager that closes a session at its end, within half a second.

    Zenoh waits for links whose other ends read nothing. If the session is not closed in time and
    the block raised no error, this process ends at once, with exit status 0.
    """
    done = False
    try:
        yield session
        done = True
    finally:
        closed = threading.Event()

        def close() -> None:
            try:
                session.close()
            except zenoh.ZError as error:
                log.warning("%s", first_line(error))
            closed.set()

        threading.Thread(target=close, name="crux-close", daemon=True).start()
        # [s] a session may take so long to close
        if not closed.wait(timeout=0.5) and done:
            logging.shutdown()
            sys.stdout.flush()
            os._exit(0)


def listening(config: zenoh.Config) -> list[str]:
    """Return the endpoints on which a session with a configuration would listen.

    Returns
    -------
    list of str
        Endpoints of the configuration's mode, such as ``tcp/127.0.0.1:7447``.
    """
    endpoints = msgspec.json.decode(config.get_json("listen/endpoints"))
    if isinstance(endpoints, dict):
        mode = msgspec.json.decode(config.get_json("mode"))
        endpoints = endpoints.get(mode or SESSION_MODES[0], [])
    return [str(endpoint) for endpoint in endpoints]


def closed(config: zenoh.Config) -> None:
    """Restrict a configuration that names no endpoint to programs on this machine, in place.

    The session then listens on the loopback address alone, and searches by multicast on the
    loopback interface alone. In client mode nothing changes. A port 0, which leaves the choice to
    the system, is replaced by a free port, so that the port can be printed.

    Parameters
    ----------
    config : zenoh.Config
        Changed in place.

    Raises
    ------
    InvalidInputError
        If zenoh does not accept the endpoints.
    """
    unsaid = config.get_json("listen/endpoints") == zenoh.Config().get_json("listen/endpoints")
    mode = msgspec.json.decode(config.get_json("mode"))
    if mode == "client":
        return
    if unsaid:
        # zenoh's routers listen on 7447 by default
        port, loopback = 7447 if mode == "router" else 0, "127.0.0.1"
        _insert(config, "listen/endpoints", _json([f"tcp/{loopback}:{port}"]), "--listen")
        if msgspec.json.decode(config.get_json("scouting/multicast"))["interface"] is None:
            _insert(config, "scouting/multicast/interface", _json(loopback), "--listen")
    endpoints = [_with_port(endpoint) for endpoint in listening(config)]
    _insert(config, "listen/endpoints", _json(endpoints), "--listen")


def exposed(config: zenoh.Config) -> list[str]:
    """Return the endpoints of a configuration that programs on other machines can reach.

    Returns
    -------
    list of str
        Endpoints whose address is not a loopback address.
    """
    return [each for each in listening(config) if not _is_loopback(each)]


def _with_port(endpoint: str) -> str:
    """Return an endpoint whose port is no longer the system's to choose."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in {"tcp", "tls", "udp"} or port != "0":
        return endpoint
    family = socket.AF_INET6 if host.startswith("[") else socket.AF_INET
    kind = socket.SOCK_DGRAM if protocol == "udp" else socket.SOCK_STREAM
    with socket.socket(family, kind) as probe:
        probe.bind((host.strip("[]"), 0))
        return f"{protocol}/{host}:{probe.getsockname()[1]}"


def _is_loopback(endpoint: str) -> bool:
    host = endpoint.partition("/")[2].partition("#")[0].rpartition(":")[0].strip("[]")
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def start_zenoh_log() -> None:
    """Start zenoh's log on standard error: errors, or the levels in the variable ``RUST_LOG``.

    Zenoh writes its log to file descriptor 1, standard output, which is for results. Descriptor 1
    therefore becomes a copy of standard error, and `sys.stdout` writes to the original standard
    output. The log has colours on a terminal alone.
    """
    sys.stdout.flush()
    standard_output, standard_error = 1, 2
    results = os.dup(standard_output)
    os.dup2(standard_error, standard_output)
    sys.stdout = os.fdopen(results, "w", encoding=sys.stdout.encoding)
    plain = not os.isatty(standard_error) and "NO_COLOR" not in os.environ
    if plain:
        # zenoh colours what it writes to files and journals, too
        os.environ["NO_COLOR"] = "1"
    zenoh.init_log_from_env_or("error")
    if plain:
        del os.environ["NO_COLOR"]


def _read(file: Path | None) -> zenoh.Config:
    source, field = str(file), "--config"
    if file is None:
        source, field = os.environ.get("ZENOH_CONFIG", ""), "ZENOH_CONFIG"
        if not source:
            return zenoh.Config()
    try:
        # zenoh's error does not say whether the file is there
        Path(source).open("rb").close()
        return zenoh.Config.from_file(source)
    except OSError as error:
        raise InvalidInputError(f"{source}: {error.strerror}", field=field) from None
    except zenoh.ZError as error:
        place = re.search(r"line: (\d+), column: (\d+)", str(error))
        where = "" if place is None else f", line {place[1]}, column {place[2]}"
        # else it lists the fields itself
        more = "" if "unknown field" in str(error) else "; see zenoh's DEFAULT_CONFIG.json5"
        said = f"{source}{where}: {_complaint(error)}{more}"
        raise InvalidInputError(said, field=field) from None


def _insert(config: zenoh.Config, key: str, value: str, flag: str) -> None:
    try:
        config.insert_json5(key, value)
    except zenoh.ZError as error:
        raise InvalidInputError(
            f"{key}: {_complaint(error)}; got {_shown(value)}", field=flag
        ) from None


def _must_be_endpoint(endpoint: str, flag: str) -> None:
    """Refuse what zenoh cannot be connected to, nor listen on."""
    problem: str | None = None
    try:
        zenoh.Config().insert_json5("connect/endpoints", _json([endpoint]))
    except zenoh.ZError:
        problem = "no protocol/address"
    protocol, _, address = endpoint.partition("/")
    port = address.partition("?")[0].partition("#")[0].rpartition(":")[2]
    if protocol in ("tcp", "udp", "tls", "quic") and problem is None:
        if ":" not in address:
            problem = "no port"
        elif not (port.isascii() and port.isdigit() and int(port) < 2**16):
            problem = f"{port!r} is no port"
    if problem is not None:
        raise InvalidInputError(
            f"{_shown(endpoint)} is not an endpoint ({problem}); valid is, for example, "
            "tcp/127.0.0.1:7447",
            field=flag,
        )


def _json(value: object) -> str:
    return msgspec.json.encode(value).decode()


def _complaint(error: Exception) -> str:
    """Return what zenoh has against a part of a configuration, without how it is made."""
    said = re.search(r'(?:msg: |message: |Error\(|Str\()"((?:[^"\\]|\\.)*)"', str(error))
    words = str(error) if said is None else said[1].replace(r"\n", "\n")
    words = words.partition(" at /")[0]
    # a parser's drawing of the place, and what was expected there
    where, equals, expected = words.partition("= expected ")
    if equals:
        place = where.partition("-->")[2].split()
        line, _, column = place[0].partition(":")
        return f"JSON5, line {line}, column {column}: expected {' '.join(expected.split())}"
    return " ".join(words.split())


def _shown(text: str) -> str:
    """Return what was given, not too long."""
    most = 60
    return repr(text) if len(text) <= most else f"{text[:most]!r}…"
