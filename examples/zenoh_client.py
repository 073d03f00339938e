"""Ask a running service for a plan, then for set-points of a wrench that drifts, with zenoh alone.

crux serve -l tcp/127.0.0.1:7447
python examples/zenoh_client.py [tcp/127.0.0.1:7447 [STANCE.json]]
"""

import json
import math
import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import zenoh

BUNDLED = Path(__file__).parents[1] / "service" / "examples" / "wall-300.json"
STEPS = 20
SWAY = 8.0
"""How much the force up the wall sways [N]."""


class Asking:
    """Asks one service; each question is counted, by which the service knows its client."""

    def __init__(self, session: zenoh.Session, robot: str = "robosimian") -> None:
        self.session, self.robot = session, robot
        self.querier = session.declare_querier(f"crux/{robot}/*")
        self.counted: Iterator[int] = count(1)

    def ask(self, name: str, message: dict[str, Any]) -> dict[str, Any]:
        """Return the reply, or what has an ``error`` with ``kind``, ``field`` and ``message``."""
        answers = self.session.get(
            f"crux/{self.robot}/{name}",
            payload=json.dumps(message).encode(),
            encoding="application/json",
            source_info=zenoh.SourceInfo(self.querier.id, next(self.counted)),
        )
        for answer in answers:
            told = answer.ok or answer.err
            if told is not None:
                reply: dict[str, Any] = json.loads(told.payload.to_bytes())
                return reply
        raise SystemExit(f"no service answers at crux/{self.robot}/{name}: is crux serve there?")


def main(endpoint: str, stance: Path) -> None:
    """Ask, and print what the tendons are to do."""
    settings = zenoh.Config()
    settings.insert_json5("mode", '"client"')
    settings.insert_json5("connect/endpoints", json.dumps([endpoint]))
    request = json.loads(stance.read_text(encoding="utf-8"))
    try:
        session = zenoh.open(settings)
    except zenoh.ZError as error:
        raise SystemExit(f"no service answers at {endpoint}: {error}") from None
    with session:
        service = Asking(session)
        plan = service.ask("plan", request | {"detail": "set_points"})
        if "error" in plan:
            raise SystemExit(f"{plan['error']['kind']}: {plan['error']['message']}")
        if plan["hands"] is None:
            raise SystemExit(f"{plan['status']}: {plan['reason']}")
        print(f"{plan['status']}: utilisation {plan['utilisation']:.2f}")
        stream = service.ask("stream", {"v": 1, "stance": request["stance"]})
        fx, *others = stream["body_wrench"]  # x of B is up the wall
        for step in range(STEPS):
            sway = SWAY * math.sin(2.0 * math.pi * step / STEPS)
            asked = {"stream": stream["stream"], "body_wrench": [fx + sway, *others]}
            points = service.ask("set_points", {"v": 1, **asked, "detail": "set_points"})
            if "error" in points:
                # and keep the set-points of before
                print(f"{points['error']['kind']}: {points['error']['message']}")
            elif points["hands"] is None:
                print(f"{points['status']}: {points['reason']}")
            else:
                first = points["hands"][0]
                tensions = ", ".join(f"{tension:.1f}" for tension in first["tensions"])
                print(f"{step:2} {points['source']:12} {first['limb']}: {tensions} N")


if __name__ == "__main__":
    given = sys.argv[1:]
    main(given[0] if given else "tcp/127.0.0.1:7447", Path(given[1]) if given[1:] else BUNDLED)
