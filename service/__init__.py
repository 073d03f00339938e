"""The outside world: messages, the zenoh service and its client, and the ``crux`` command.

    bytes → request → planner.stance.Question → planner.plan.Plan → reply → bytes

``requests`` and ``replies`` say what travels, ``codec`` how; ``questions`` and ``answers`` stand
between the messages and the planner; ``dispatch`` puts them together, and ``server``, ``client``
and ``command`` are ways to reach it.
"""

from service.client import CruxClient
from service.requests import BodySpaceRequest, PlanRequest, WrenchSpaceRequest

__all__ = ["BodySpaceRequest", "CruxClient", "PlanRequest", "WrenchSpaceRequest"]
