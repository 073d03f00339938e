"""Say why no service answers a client, by what its session sees."""

from __future__ import annotations

from typing import Final

import zenoh

from service.servers.topology import token_ids
from service.wire import ServiceName, service_key

__all__ = ["HOW_TO_START", "silence_in_words", "why_absent"]

HOW_TO_START: Final = "start a service with `crux serve` where this session reaches it"
TOKEN_TIMEOUT: Final = 1.0
"""Longest wait for services' tokens, to say why there is no answer [s]."""


def why_absent(session: zenoh.Session, robot: str) -> str:
    """Return why no service of a robot may be there, and what to do, in words after a colon.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot.
    """
    others = sorted(_robots(session) - {robot})
    if others:
        return (
            f"services of {', '.join(others)} are there: ask for that robot (--robot, or "
            f"CruxClient(..., robot={others[0]!r})), or {HOW_TO_START}"
        )
    if not session.info.transports():
        return f"this session is connected to nobody; {HOW_TO_START}"
    return (
        "this session is connected, but sees no service that is ready: one that starts for the "
        f"first time compiles for minutes; wait for it (wait, --wait), or {HOW_TO_START}"
        f"{_rights(session)}"
    )


def silence_in_words(session: zenoh.Session, robot: str, name: str) -> str:
    """Return why nobody answers a kind of question, and what to do.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot.
    name : str
        A `ServiceName`.
    """
    key = service_key(robot, name)
    if token_ids(session, service_key(robot, ServiceName.ALIVE), TOKEN_TIMEOUT):
        return (
            f"a service of {robot} is there, but does not answer at {key}: this session may have "
            f"no right to ask there (see crux keys), or the service has just ended"
            f"{_rights(session)}"
        )
    return f"no service answers at {key}: {why_absent(session, robot)}"


def _robots(session: zenoh.Session) -> set[str]:
    """Return the names of all robots whose services the session sees."""
    key = service_key("*", ServiceName.ALIVE)
    tokens = session.liveliness().get(key, timeout=TOKEN_TIMEOUT)
    return {str(each.ok.key_expr).split("/")[1] for each in tokens if each.ok is not None}


def _rights(session: zenoh.Session) -> str:
    """Return what to look at where keys decide who may ask; nothing without keys."""
    ends = {str(end).partition("/")[0] for each in session.info.links() for end in (each.dst,)}
    if not ends & {"tls", "quic"}:
        return ""
    return (
        "; a name has the rights of crux keys add only once services and routers have the new "
        "files and have been started anew (crux keys list)"
    )
