"""Plan a stance on a wall, print who carries what, and draw it.

python examples/plan_and_plot.py [plan.png]
"""

import math
import sys
from pathlib import Path

import numpy as np

from hand_models import Cylinder, Grasp, Pose, Surface
from planner import HandOnHold, Limits, Question, Stance, plan, plot_plan

# columns: x, y, z of the frame, in the world, whose z is up
UP_THE_WALL = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
INTO_THE_WALL = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])

# limb: across and up the wall [m]
PLACES = {
    "front_right": (-0.45, 0.6),
    "rear_right": (-0.45, -0.6),
    "rear_left": (0.45, -0.6),
    "front_left": (0.45, 0.6),
}


def stance() -> Stance:
    """Four hands that pinch logs of 300 mm on a vertical wall."""
    hands = tuple(
        HandOnHold(
            limb=limb,
            pose=Pose(np.array([0.0, across, up]), INTO_THE_WALL),
            hold=Cylinder(diameter=0.3),
            surface=Surface.named("rock"),
            grasp=Grasp(outer_rotation=math.pi),
        )
        for limb, (across, up) in PLACES.items()
    )
    return Stance(hands, body=Pose(np.array([-0.45, 0.0, 0.0]), UP_THE_WALL))


def main(picture: Path) -> None:
    """Plan, print and draw."""
    question = Question(stance(), limits=Limits(utilisation=0.97), want=frozenset({"load_factor"}))
    answer = plan(question)
    print(f"{answer.status}: utilisation {answer.utilisation:.2f}, {answer.reason}")
    for hand in answer.hands or ():
        tensions = ", ".join(f"{finger.tendon_tension:.0f} N" for finger in hand.fingers)
        print(f"{hand.limb:12} {tensions}")
    plot_plan(answer, question, picture)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "plan.png"))
