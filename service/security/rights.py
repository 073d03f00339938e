"""Define what each role may do: zenoh's access control, by the names in certificates.

Zenoh checks each message on a link by the certificate at the link's other end. A message is allowed
if its key is included in one of the keys of the role, so a query with wildcards that reach further
is not answered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, Final

from service.wire import ServiceName, server_key, service_key, stream_key

__all__ = ["Role", "access_control"]


class Role(StrEnum):
    """Role of the owner of a certificate: what it may do."""

    SERVICE = "service"
    """Answer questions, and publish set-points."""
    PLANNER = "planner"
    """Ask all questions, declare streams and publish their wrenches, and take set-points."""
    PLAYER = "player"
    """Do what a planner may, and publish the set-points of a climb to the robot."""
    OBSERVER = "observer"
    """Read health and metrics, and see which services and streams there are."""
    ROUTER = "router"
    """Pass on what others may send."""
    ROS = "ros"
    """Do anything in one ROS domain, and nothing else."""


LIVELINESS_MESSAGES: Final = ("liveliness_query", "declare_liveliness_subscriber")
ALL_MESSAGES: Final = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    *LIVELINESS_MESSAGES,
)

Rule = tuple[Sequence[str], Sequence[str]]
"""Kinds of messages, and the keys for which they are allowed."""


def access_control(
    robot: str, names_by_role: Mapping[Role, Sequence[str]], domain: int | None
) -> dict[str, Any]:
    """Return zenoh's ``access_control`` for a node to which others link: a service or a router.

    Parameters
    ----------
    robot : str
        Name of the robot whose keys are meant.
    names_by_role : mapping of Role to sequence of str
        Common names of the certificates of each role.
    domain : int or None
        ROS domain in which services and ROS nodes may do anything; None for none.
    """
    rules, policies = [], []
    for role in Role:
        names = names_by_role.get(role, ())
        if not names:
            continue
        received, sent = _rights(role, robot, domain)
        for flow, allowed in (("ingress", received), ("egress", sent)):
            for i, (messages, keys) in enumerate(allowed):
                rules.append(
                    {
                        "id": f"{role} {flow} {i}",
                        "permission": "allow",
                        "flows": [flow],
                        "messages": list(messages),
                        "key_exprs": list(keys),
                    }
                )
        own = [each["id"] for each in rules if str(each["id"]).startswith(f"{role} ")]
        policies.append({"rules": own, "subjects": [str(role)]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [
            {"id": str(role), "cert_common_names": list(names_by_role[role])}
            for role in Role
            if names_by_role.get(role)
        ],
        "policies": policies,
    }


def _rights(role: Role, robot: str, domain: int | None) -> tuple[list[Rule], list[Rule]]:
    """Return what is received from an owner of a role, and what is sent to one."""
    in_ros = () if domain is None else _ros_keys(domain)
    everything: list[Rule] = [(ALL_MESSAGES, (service_key(robot, "**"), *in_ros))]
    anything: list[Rule] = [(ALL_MESSAGES, in_ros)] if in_ros else []
    questions = (service_key(robot, "*"), server_key(robot, "*", "*"))
    looks = [
        key
        for name in (ServiceName.HEALTH, ServiceName.METRICS)
        for key in (service_key(robot, name), server_key(robot, "*", name))
    ]
    tokens = (
        service_key(robot, ServiceName.ALIVE),
        server_key(robot, "*"),
        stream_key(robot, "*"),
    )
    clients = (service_key(robot, f"{ServiceName.CLIENTS}/*"),)
    wrenches = (stream_key(robot, "*", ServiceName.WRENCH),)
    points = (stream_key(robot, "*", ServiceName.SET_POINTS),)
    play = (service_key(robot, ServiceName.PLAY),)
    observer: tuple[list[Rule], list[Rule]] = (
        [(("query",), looks), (LIVELINESS_MESSAGES, tokens)],
        [(("reply", "declare_queryable"), looks), (("liveliness_token",), tokens)],
    )
    planner: tuple[list[Rule], list[Rule]] = (
        [
            (("query",), questions),
            (LIVELINESS_MESSAGES, tokens),
            (("put",), wrenches),
            (("declare_subscriber",), (*points, *play)),
            (("reply", "declare_queryable", "liveliness_token"), clients),
        ],
        [
            (("reply", "declare_queryable"), questions),
            (("liveliness_token",), tokens),
            (("declare_subscriber",), wrenches),
            (("put",), (*points, *play)),
            (("query", *LIVELINESS_MESSAGES), clients),
        ],
    )
    # what a planner sends a service, a service receives; and it looks for others of its kind
    service: tuple[list[Rule], list[Rule]] = (
        [
            (("reply", "declare_queryable"), questions),
            (("liveliness_token", *LIVELINESS_MESSAGES), tokens),
            (("declare_subscriber",), wrenches),
            (("put",), points),
            (("query", *LIVELINESS_MESSAGES), clients),
            *anything,
        ],
        [
            (("query",), questions),
            (("liveliness_token", *LIVELINESS_MESSAGES), tokens),
            (("put",), wrenches),
            (("declare_subscriber",), points),
            (("reply", "declare_queryable", "liveliness_token"), clients),
            *anything,
        ],
    )
    plays: tuple[list[Rule], list[Rule]] = (
        [*planner[0], (("put",), play)],
        [*planner[1], (("declare_subscriber",), play)],
    )
    return {
        Role.SERVICE: service,
        Role.PLANNER: planner,
        Role.PLAYER: plays,
        Role.OBSERVER: observer,
        Role.ROUTER: (everything, everything),
        Role.ROS: (anything, anything),
    }[role]


def _ros_keys(domain: int) -> tuple[str, ...]:
    """Return the keys of a ROS domain: topics and services, those with a history, tokens."""
    return (f"{domain}/**", f"{domain}/**/@adv/**", f"@ros2_lv/{domain}/**")
