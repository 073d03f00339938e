"""Open zenoh sessions, at whichever of several endpoints answers."""

from __future__ import annotations

import math
import re
import time
from typing import Any, Final

import msgspec
import zenoh

from service.wire import NoServiceError

__all__ = ["first_line", "open_session"]

TLS_SECRETS: Final = tuple(
    f"transport/link/tls/{name}_base64"
    for name in (
        "root_ca_certificate",
        "connect_certificate",
        "connect_private_key",
        "listen_certificate",
        "listen_private_key",
    )
)
FIRST_SHARE: Final = 0.5
"""How long the first of several endpoints is tried before the next is [s]; it doubles each round.
A link that is there opens within it, over TLS too; of a machine that is off nothing is heard."""


def open_session(config: zenoh.Config, wait: float | None = None) -> zenoh.Session:
    """Open a zenoh session from a configuration.

    Parameters
    ----------
    config : zenoh.Config
        Configuration; left unchanged.
    wait : float, optional
        Longest time for which a session in client mode goes on trying to connect, to each of its
        endpoints in turn [s]; in other modes, the open session retries in the background. Without
        it, each endpoint is tried once.

    Raises
    ------
    NoServiceError
        If zenoh cannot open the session: nobody to connect to, or an address that is in use.
    """
    if wait is None:
        return _opened(config)
    endpoints = _endpoints(config)
    if len(endpoints) < 2:
        return _opened(_patient(config, wait, endpoints))
    begun, share, turn, failed = time.monotonic(), FIRST_SHARE, 0, None
    while True:
        now = time.monotonic()
        left = max(begun + wait - now, 0.0)
        order = endpoints[turn:] + endpoints[:turn]
        try:
            # zenoh stays with the first as long as it may
            return _opened(_patient(config, min(share, left), order))
        except NoServiceError as error:
            failed = failed or error
            # what fails before its time is over, such as a wrong certificate, is not waited for
            over_early = time.monotonic() - now < 0.9 * min(share, left)
            if left <= share or over_early:
                raise failed from None
        turn = (turn + 1) % len(endpoints)
        share *= 1.0 if turn else 2.0


def _opened(config: zenoh.Config) -> zenoh.Session:
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        said = first_line(error)
        # zenoh does not say why a link over TLS is refused
        checks = " and its certificates (crux keys list)" if "tls/" in said else ""
        raise NoServiceError(
            f"no zenoh session: {said}; check its endpoints (--connect, --listen){checks}"
        ) from None


def first_line(error: Exception) -> str:
    """Return zenoh's complaint without where in its source it was made."""
    said = str(error).partition(" at /")[0].partition("\n")[0]
    return re.sub(r"Single\((.*?)\)", r"\1", said).strip(" !")


def _endpoints(config: zenoh.Config) -> list[Any]:
    """Return the endpoints to which a session in client mode connects; none in other modes."""
    if msgspec.json.decode(config.get_json("mode")) != "client":
        return []
    found = msgspec.json.decode(config.get_json("connect/endpoints"))
    return list(found.get("client", []) if isinstance(found, dict) else found)


def _patient(config: zenoh.Config, seconds: float, endpoints: list[Any]) -> zenoh.Config:
    """Return a copy of a zenoh configuration whose session keeps trying to connect (retry).

    Parameters
    ----------
    config : zenoh.Config
        Configuration to copy; left unchanged.
    seconds : float
        Timeout of connecting and of searching, in client mode [s].
    endpoints : list
        Endpoints to connect to, the first of them first; none for those of the configuration.
    """
    copy = zenoh.Config.from_json5(str(config))
    for name in TLS_SECRETS:
        # these zenoh leaves out of the text of a configuration
        if msgspec.json.decode(value := config.get_json(name)) is not None:
            copy.insert_json5(name, value)
    if msgspec.json.decode(copy.get_json("connect/retry")) is None:
        retries = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
        copy.insert_json5("connect/retry", _json(retries))
    if endpoints:
        copy.insert_json5("connect/endpoints", _json(endpoints))
    if msgspec.json.decode(copy.get_json("mode")) == "client":
        # others go on looking while they are open
        for key in ("connect/timeout_ms", "scouting/timeout"):
            copy.insert_json5(key, _json(math.ceil(1e3 * seconds)))
    return copy


def _json(value: object) -> str:
    return msgspec.json.encode(value).decode()
