"""The outside world: messages, the zenoh service and its client, and the ``crux`` command.

    bytes → request → planner.question.Question → planner.result.Plan → reply → bytes

``requests`` and ``replies`` say what travels, ``wire`` how; ``answering`` stands between messages
and the planner; ``serving``, ``bulk``, ``processes`` and ``commands`` are ways to reach it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
