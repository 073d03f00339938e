"""The outside world: messages, the zenoh service and its client, and the ``crux`` command.

    bytes → request → planner.stance.Question → planner.plan.Plan → reply → bytes

``requests`` and ``replies`` say what travels, ``codec`` how; ``questions`` and ``answers`` stand
between the messages and the planner; ``dispatch`` puts them together, and ``server``, ``client``,
``command`` and, for many requests at once, ``many`` are ways to reach it.
"""

from service.client import CruxClient
from service.requests import BodySpaceRequest, PlanRequest, WrenchSpaceRequest
from service.stream_messages import SetPointsRequest, StreamRequest

__all__ = [
    "BodySpaceRequest",
    "CruxClient",
    "PlanRequest",
    "SetPointsRequest",
    "StreamRequest",
    "WrenchSpaceRequest",
]
