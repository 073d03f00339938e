"""Static equilibrium by hpp-centroidal-dynamics: contacts on standard input, margins on output.

Its shared library is found only with its folder on the library path from the start of the process,
so that it runs in a process of its own: `margins` starts it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

PREFIX = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "lib"


def margins(cases: list[dict], edges: int) -> list[float | None]:
    """Return each case's robustness [N], None where no forces balance.

    A case has points and normals (n, 3), one friction coefficient, a mass and a centre of mass.
    """
    return timed(cases, edges, 1)[0]


def timed(
    cases: list[dict], edges: int, rounds: int
) -> tuple[list[float | None], list[list[float]]]:
    """Return the `margins`, and how long each took in each of some rounds [s]."""
    folder = next(PREFIX.glob("python3*/site-packages"))
    environment = os.environ | {
        "LD_LIBRARY_PATH": str(PREFIX),
        "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]),
    }
    done = subprocess.run(
        [sys.executable, __file__],
        input=json.dumps({"cases": cases, "edges": edges, "rounds": rounds}),
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
    )
    # the library itself writes to standard output, too
    found = json.loads(done.stdout.splitlines()[-1])
    return found["margins"], found["seconds"]


def main() -> None:
    import hpp_centroidal_dynamics as centroidal
    import numpy as np

    asked = json.load(sys.stdin)
    found: list[float | None] = []
    seconds: list[list[float]] = []
    for number in range(asked["rounds"]):
        seconds.append([])
        for case in asked["cases"]:
            points, normals = (
                np.asfortranarray(case[name], dtype=float) for name in ("points", "normals")
            )
            place = np.array(case["com"], dtype=float)
            start = time.perf_counter()
            problem = centroidal.Equilibrium(
                "contacts", case["mass"], asked["edges"], centroidal.SOLVER_LP_QPOASES
            )
            assert problem.setNewContacts(
                points, normals, float(case["friction"]), centroidal.EQUILIBRIUM_ALGORITHM_LP
            )
            status, margin = problem.computeEquilibriumRobustness(place)
            seconds[-1].append(time.perf_counter() - start)
            if number == 0:
                optimal = status == centroidal.LP_STATUS_OPTIMAL
                found.append(float(margin) if optimal else None)
    print(json.dumps({"margins": found, "seconds": seconds}))


if __name__ == "__main__":
    main()
