"""Keep a robot on the wall while its tiles slip, one after the other: ask, slip, ask again.

crux serve -l tcp/127.0.0.1:7447
python examples/recover_from_slips.py [tcp/127.0.0.1:7447]
"""

import random
import sys
from itertools import product

from planner import LostTile
from service import CruxClient, SetPointsRequest, StreamRequest
from service.commands.stances import read_request
from service.serving import zenoh_config

SLIPS = 8
PHALANGES = ("proximal", "middle", "distal")
FINGERS = ("outer_left", "inner_left", "inner_right", "outer_right")


def main(endpoint: str) -> None:
    """Print the answer after each slip."""
    stance = read_request("wall-300").stance
    config = zenoh_config(mode="client", connect=[endpoint], multicast=False)
    with CruxClient(config) as client:
        stream = client.stream(StreamRequest(v=1, stance=stance))
        # nine tenths of the robot's weight
        fx, fy, fz, mx, my, mz = (0.9 * part for part in stream.body_wrench)
        limbs = [hand.limb for hand in stream.hands]
        tiles = [LostTile(*names) for names in product(limbs, FINGERS, PHALANGES)]
        # here a controller would detect each slip
        slips = random.Random(3).sample(tiles, SLIPS)
        for slipped in range(1, SLIPS + 1):
            lost = slips[:slipped]
            asked = SetPointsRequest(
                v=1, stream=stream.stream, body_wrench=(fx, fy, fz, mx, my, mz), lost=lost
            )
            points = client.set_points(asked)
            assert points.verified
            where = f"{lost[-1].limb} {lost[-1].finger} {lost[-1].phalanx}"
            if points.status == "optimal":
                said = f"holds, utilisation {points.utilisation:.3f}"
            else:
                said = f"{points.status}, save {points.save_first} first: {points.reason}"
            print(f"{where}: {said}; {1e3 * points.took:.1f} ms")


if __name__ == "__main__":
    main(sys.argv[1] if sys.argv[1:] else "tcp/127.0.0.1:7447")
