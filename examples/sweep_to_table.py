"""Find how heavy the robot may be on rocks of different strength, and write a table.

python examples/sweep_to_table.py [sweep.csv]
"""

import sys
from pathlib import Path

from service import Variation, sweep
from service.commands.stances import read_request

MASSES = (60.0, 160.0, 6)
STRENGTHS = (50.0, 90.0, 3)
"""Of a tile on the rock [N]: from, to, how many."""


def main(table: Path) -> None:
    """Sweep, write the table, and print the heaviest robot that each rock holds."""
    request = read_request("wall-300")  # or the path of a file
    found = sweep(
        request,
        [
            Variation.over("hands.*.surface.shear_limit", *STRENGTHS),
            Variation.over("load.mass", *MASSES),
        ],
    )
    found.write_table(table)
    print(found.counts)
    heaviest: dict[str, str] = {}
    for row in found.rows:
        strength, mass = map(str, row.point)
        if row.status == "optimal":
            heaviest[strength] = mass  # masses rise from row to row
    for strength, mass in heaviest.items():
        print(f"{strength} N a tile: up to {mass} kg of those tried")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "sweep.csv"))
