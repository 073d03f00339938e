"""Draw the frames W, B, H, F and P with a hand on a log: ``python docs/draw_frames.py``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from hand_models import Cylinder, Grasp, SpinyHand, Surface
from hand_models.base import COLOUR_OF, Array, write_picture
from hand_models.hand import SettledHand

PICTURE = Path(__file__).parent / "frames.png"
DIAMETER = 0.3
AXIS_COLOURS = (COLOUR_OF["red"], COLOUR_OF["green"], COLOUR_OF["blue"])


def triad(axes: Any, origin: Array, directions: Array, size: float, name: str) -> None:
    """Draw the x, y and z axes of a frame, given as columns, and its name."""
    for axis, colour, letter in zip(directions.T, AXIS_COLOURS, "xyz", strict=True):
        end = origin + size * axis
        axes.plot(*np.column_stack([origin, end]), color=colour, linewidth=2)
        axes.text(*(origin + 1.15 * size * axis), letter, color=colour, fontsize=8)
    away = origin - 0.45 * size * directions.sum(axis=1)
    axes.text(*away, name, fontsize=13, fontweight="bold", ha="center", va="center")


def finger_chain(settled: SettledHand, index: int) -> Array:
    """Return the joints and the end of a finger of a closed hand in H, shape (4, 3) [m]."""
    frame = settled.hand.frames(settled.grasp.outer_rotation)[index]
    finger, up = settled.fingers[index], np.array([0.0, 0.0, 1.0])
    places = np.array([*(contact.joint for contact in finger.contacts), finger.pin])
    return np.asarray(frame.joint + places[:, :1] * frame.along + places[:, 1:] * up)


def draw_hand(axes: Any) -> None:
    """Draw a hand on a log in its own frame H, with the frames of one finger."""
    grasp = Grasp(outer_rotation=math.pi)
    hand = SpinyHand()
    settled = hand.settle(Cylinder(diameter=DIAMETER), Surface.named("rock"), grasp)
    palm = settled.hand.palm_tiles
    axes.scatter(*palm.T, marker="s", s=90, color="0.6", label="palm tiles", depthshade=False)
    frames = settled.hand.frames(grasp.outer_rotation)
    up = np.array([0.0, 0.0, 1.0])
    for i, frame in enumerate(frames):
        chain = finger_chain(settled, i)
        *joints, tip = chain
        axes.plot(*chain.T, "-o", color="black", linewidth=3, markersize=4)
        tiles = settled.positions[settled.finger_of == i]
        axes.scatter(*tiles.T, marker="s", s=25, color=COLOUR_OF["amber"], depthshade=False)
        if i == 1:
            across = np.cross(up, frame.along)
            triad(axes, frame.joint, np.column_stack([frame.along, across, up]), 0.035, "F")
            along = (tip - joints[-1]) / np.linalg.norm(tip - joints[-1])
            turned = np.column_stack([along, across, np.cross(along, across)])
            triad(axes, joints[-1], turned, 0.03, "P")
    triad(axes, np.zeros(3), np.eye(3), 0.06, "H")
    turn, length = np.meshgrid(np.linspace(-2.6, -0.55, 24), np.linspace(-0.11, 0.11, 2))
    radius = 0.5 * DIAMETER
    crest = settled.seating.pose.position
    axes.plot_surface(
        crest[0] + radius * np.cos(turn),
        length,
        crest[2] + radius * (1.0 + np.sin(turn)),
        color="tan",
        alpha=0.2,
    )


def draw_robot(axes: Any) -> None:
    """Draw the world and the body in front of a wall."""
    up_the_wall = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    into_the_wall = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    y, z = np.meshgrid([-0.7, 0.7], [-0.9, 0.9])
    axes.plot_surface(0.0 * y, y, z, color="tan", alpha=0.3)
    body = np.array([-0.45, 0.0, 0.0])
    triad(axes, body, up_the_wall, 0.3, "B")
    for height in (-0.6, 0.6):
        for across in (-0.45, 0.45):
            place = np.array([0.0, across, height])
            axes.plot(*np.column_stack([body, place]), color="0.7", linewidth=2)
            triad(axes, place, into_the_wall, 0.18, "H")
    triad(axes, np.array([-0.9, 0.7, -0.9]), np.eye(3), 0.3, "W")


def main() -> None:
    """Draw both views and write the picture."""
    figure = plt.figure(figsize=(11.0, 5.2), layout="constrained")
    for place, draw, title, (elevation, azimuth) in (
        (121, draw_robot, "world W, body B, four hands H", (18.0, -145.0)),
        (122, draw_hand, "hand H, finger F, phalanx P (of inner_left)", (24.0, -102.0)),
    ):
        axes: Any = figure.add_subplot(place, projection="3d")
        draw(axes)
        axes.set_title(title)
        axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        axes.view_init(elevation, azimuth)
        axes.set_aspect("equal")
        axes.tick_params(labelsize=7)
    write_picture(figure, PICTURE)


if __name__ == "__main__":
    main()
