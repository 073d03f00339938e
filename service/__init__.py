"""The outside world: messages, the zenoh service and its client, and the ``crux`` command.

    bytes → request → planner.stance.Question → planner.plan.Plan → reply → bytes

``requests`` and ``replies`` say what travels, ``codec`` how; ``questions`` and ``answers`` stand
between the messages and the planner; ``dispatch`` puts them together, and ``server``, ``client``,
``command`` and, for many requests at once, ``many`` are ways to reach it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
