"""Draw how a hand settles: two fingers in their planes, closed and with a compliant wrist.

``python docs/draw_wrists.py`` plans the bundled stance ``wall-300`` and writes ``docs/wrists.png``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import msgspec
import numpy as np

from draw_frames import finger_chain
from hand_models import Pose, spiny_hand
from hand_models.base import COLOUR_OF, turns_about, write_picture
from hand_models.hand import FINGERS, SettledHand
from planner import plan
from planner.prepare import settle_hand
from planner.result import HandPlan
from service.answering import question
from service.commands.stances import read_request

PICTURE = Path(__file__).parent / "wrists.png"
LIMB, SHOWN = "rear_left", ("inner_left", "outer_left")


def draw(axes: Any, settled: SettledHand, hand: HandPlan) -> None:
    """Draw one hand seen along y of H: in grey closed, in blue where its wrist settles."""
    assert hand.wrist is not None
    moved = Pose(hand.wrist.twist[:3], turns_about(hand.wrist.twist[3:]))
    there = spiny_hand().settle(
        settled.hold,
        settled.surface,
        settled.grasp,
        hold_in_hand=moved.inverse() @ settled.seating.pose,
    )
    mm = 1e3
    for name in SHOWN:
        rest, after = (finger_chain(each, FINGERS.index(name)) for each in (settled, there))
        after = after @ moved.rotation.T + moved.position
        axes.plot(mm * rest[:, 0], mm * rest[:, 2], "-o", color="0.6", linewidth=2, markersize=3)
        axes.plot(mm * after[:, 0], mm * after[:, 2], "-o", color=COLOUR_OF["blue"], markersize=3)
    own = np.isin(settled.finger_of, [FINGERS.index(name) for name in SHOWN])
    for place, force in zip(hand.positions[own], hand.forces[own], strict=True):
        axes.annotate(
            "",
            (mm * place[0] + 0.4 * force[0], mm * place[2] + 0.4 * force[2]),
            (mm * place[0], mm * place[2]),
            arrowprops={"arrowstyle": "->", "color": COLOUR_OF["red"]},
        )
    palm = settled.hand.palm_tiles
    axes.plot(mm * palm[:, 0], mm * palm[:, 2], "s", color="0.6", label="closed")
    shifted = palm @ moved.rotation.T + moved.position
    axes.plot(mm * shifted[:, 0], mm * shifted[:, 2], "s", color=COLOUR_OF["blue"], label="settled")


def main() -> None:
    """Plan the stance and write the picture."""
    request = read_request("wall-300")
    hands = [msgspec.structs.replace(each, wrist="compliant") for each in request.stance.hands]
    stance = msgspec.structs.replace(request.stance, hands=hands)
    asked = question(msgspec.structs.replace(request, stance=stance))
    answer = plan(asked)
    assert answer.hands is not None
    hand = next(each for each in answer.hands if each.limb == LIMB)
    place = next(each for each in asked.stance.hands if each.limb == LIMB)
    settled = settle_hand(place, asked.stance)
    figure, axes = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
    crest, radius = settled.seating.pose.position, 0.15
    turn = np.linspace(np.pi - 1.15, np.pi + 1.15, 200)
    axes.plot(
        1e3 * (crest[0] + radius * np.sin(turn)),
        1e3 * (crest[2] + radius + radius * np.cos(turn)),
        color="0.3",
        label="rock, 300 mm",
    )
    draw(axes, settled, hand)
    axes.plot([], [], color=COLOUR_OF["red"], label="tile forces, 2.5 N/mm")
    axes.set_aspect("equal")
    axes.set_xlabel("x of H [mm]")
    axes.set_ylabel("z of H, into the rock [mm]")
    axes.set_title(f"{LIMB} of wall-300: one inner and one outer finger, palm")
    axes.set_ylim(-25.0, 150.0)
    axes.legend(loc="upper center", ncols=2)
    write_picture(figure, PICTURE)


if __name__ == "__main__":
    main()
