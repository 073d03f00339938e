"""Plan the loads of many hands that hold one body.

stance + question → WrenchSpace of every hand → conic program → solution → verified Plan.

What is exported is what `service` takes, and a user needs: questions (`Question`, `Stance`, `Load`,
`Limits`), `plan` and what comes of it (`Plan` and its parts), `WrenchStream`, `BodySpace`, climbs
(`Route`, `evaluate`), pictures, robots, processes, and `deadline`. Each name is loaded when it is
asked for.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
