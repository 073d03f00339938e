"""Time of making a wall to climb, of 2.5 by 4 m: placements, reach and tables, on two processes."""

from __future__ import annotations

import resource

from hand_models.rock import Mesh
from hand_models.scans import generate_wall
from planner import WallSource, robosimian
from service.processes import make_wall


def main() -> None:
    """Make the wall, and print how many seconds each phase took, and all processes worked."""
    found = generate_wall("leaning-wall", 1)
    rock = Mesh(found.vertices, found.faces, anywhere=True)
    source = WallSource(rock=rock, rock_pose=found.pose, robot=robosimian())
    made = make_wall(source, "processes", workers=2)
    wall, worked = made.wall, resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{len(wall.places)} placements of {made.tried} trials, {len(wall.bodies)} bodies")
    print(f"{int(wall.reach.reached.sum())} reached, {len(wall.reach.angles)} solutions")
    for phase, seconds in made.seconds.items():
        print(f"{phase}: {seconds:.1f} s")
    print(f"processor time of the workers: {worked.ru_utime + worked.ru_stime:.0f} s")


if __name__ == "__main__":
    main()
