"""Say what several services of one robot do, by how they are linked."""

from __future__ import annotations

import zenoh

from service.wire import server_key

__all__ = ["rivals_in_words", "token_ids"]


def token_ids(session: zenoh.Session, key: str, timeout: float) -> frozenset[str]:
    """Return the last parts of the keys of all liveliness tokens that match a key.

    Parameters
    ----------
    session : zenoh.Session
    key : str
    timeout : float
        Longest wait [s].
    """
    replies = session.liveliness().get(key, timeout=timeout)
    return frozenset(
        str(reply.ok.key_expr).rpartition("/")[2] for reply in replies if reply.ok is not None
    )


def rivals_in_words(session: zenoh.Session, robot: str, timeout: float) -> str | None:
    """Return what happens to questions, as other services of a robot are there, too.

    A service passes a question that reaches it on to those that are linked to it. Services that are
    not linked meet at a router, which passes a question on to one of them.

    Parameters
    ----------
    session : zenoh.Session
        Session of a service, whose own token does not count.
    robot : str
    timeout : float
        Longest wait for the tokens of others [s].

    Returns
    -------
    str or None
        None where there is no other service.
    """
    rivals = token_ids(session, server_key(robot, "*"), timeout) - {str(session.info.zid())}
    if not rivals:
        return None
    linked = rivals & {str(each.zid) for each in session.info.transports()}
    said = []
    if linked:
        said.append(
            f"{_others(len(linked), robot)} linked to this one: a question to one makes all of "
            "them work, and CruxClient takes the first good answer; to share the work, make them "
            "clients of a router (-m client -e ENDPOINT); --no-multicast-scouting keeps them apart"
        )
    if others := len(rivals) - len(linked):
        said.append(
            f"{_others(others, robot)} behind a router: a question gets one answer, from the "
            "nearest, and the others stand by until it ends; CruxClient(spread=True) asks all in "
            "turn"
        )
    return "; and ".join(said)


def _others(count: int, robot: str) -> str:
    few = f"another service of {robot} is"
    return few if count == 1 else f"{count} other services of {robot} are"
