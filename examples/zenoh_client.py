"""Ask a running service for a plan, then for set-points of a wrench that drifts.

crux serve -l tcp/127.0.0.1:7447
python examples/zenoh_client.py [tcp/127.0.0.1:7447]
"""

import math
import sys

from service import CruxClient, ServiceError, SetPointsRequest, StreamRequest
from service.commands.stances import read_request
from service.serving import zenoh_config

STEPS = 20
SWAY = 8.0
"""How much the force up the wall sways [N]."""


def main(endpoint: str) -> None:
    """Ask, and print what the tendons are to do."""
    request = read_request("wall-300")  # or the path of a file
    with CruxClient(zenoh_config(mode="client", connect=[endpoint])) as client:
        reply = client.plan(request)
        print(f"{reply.status}: utilisation {reply.utilisation:.2f}")
        stream = client.stream(StreamRequest(v=1, stance=request.stance))
        fx, fy, fz, mx, my, mz = stream.body_wrench  # x of B is up the wall
        for step in range(STEPS):
            sway = SWAY * math.sin(2.0 * math.pi * step / STEPS)
            wrench = (fx + sway, fy, fz, mx, my, mz)
            asked = SetPointsRequest(
                v=1, stream=stream.stream, body_wrench=wrench, detail="set_points"
            )
            try:
                points = client.set_points(asked)
            except ServiceError as error:
                print(f"{error.kind}: {error.message}")  # and keep the set-points of before
                continue
            if points.hands is None:
                print(f"{points.status}: {points.reason}")
                continue
            first = points.hands[0]
            tensions = ", ".join(f"{tension:.1f}" for tension in first.tensions)
            print(f"{step:2} {points.source:12} {first.limb}: {tensions} N")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "tcp/127.0.0.1:7447")
