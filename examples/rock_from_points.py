"""Make rock of a point cloud, and plan a stance on it.

Usage: ``python examples/rock_from_points.py [points.xyz]``

Without a file, points of a boulder are made up. The cloud is in metres and seen along +x.
"""

import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hand_models import Grasp, Mesh, Pose, Surface
from hand_models.scans import mesh_scan, read_scan
from planner import HandOnHold, Load, Question, Stance, plan

UP_THE_WALL = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
INTO_THE_WALL = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])

# limb: across and up the wall [m]
PLACES = {
    "front_right": (-0.45, 0.6),
    "rear_right": (-0.45, -0.6),
    "rear_left": (0.45, -0.6),
    "front_left": (0.45, 0.6),
}


def write_points(file: Path) -> None:
    """Write points of a rough log of some 320 mm, as a scanner in front of it sees them."""
    rng = np.random.default_rng(7)
    angle = rng.uniform(-1.4, 1.4, 40_000)
    along = rng.uniform(-0.25, 0.25, angle.size)
    rough = 0.002 * np.sin(40.0 * along) * np.cos(9.0 * angle)
    radius = 0.16 + rough + rng.normal(0.0, 2e-4, angle.size)
    points = np.column_stack([0.16 - radius * np.cos(angle), along, radius * np.sin(angle)])
    np.savetxt(file, points, fmt="%.5f")


def main(file: Path) -> None:
    """Read the points, mesh them, and plan with such a boulder in each hand."""
    rock = mesh_scan(read_scan(file, view=(1.0, 0.0, 0.0)))
    print(f"{rock.read} points, {len(rock.faces)} triangles")
    hold = Mesh(rock.vertices, rock.faces)
    hands = tuple(
        HandOnHold(
            limb=limb,
            pose=Pose(np.array([0.0, across, up]), INTO_THE_WALL),
            hold=hold,
            surface=Surface.named("rock"),
            grasp=Grasp(outer_rotation=math.pi),
        )
        for limb, (across, up) in PLACES.items()
    )
    body = Pose(np.array([-0.45, 0.0, 0.0]), UP_THE_WALL)
    answer = plan(Question(Stance(hands, body), load=Load(mass=30.0)))
    print(f"{answer.status}: utilisation {answer.utilisation:.2f}, {answer.reason}")
    for hand in answer.hands or ():
        tiles = [tile for finger in hand.fingers for tile in finger.tiles if tile.utilisation]
        print(f"{hand.limb}: {len(tiles)} tiles carry, largest {hand.utilisation:.2f}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with TemporaryDirectory() as folder:
            made_up = Path(folder) / "points.xyz"
            write_points(made_up)
            main(made_up)
