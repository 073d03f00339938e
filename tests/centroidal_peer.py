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
from pathlib import Path

PREFIX = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "lib"


def margins(cases: list[dict], edges: int) -> list[float | None]:
    """Return each case's robustness [N], None where no forces balance.

    A case has points and normals (n, 3), one friction coefficient, a mass and a centre of mass.
    """
    folder = next(PREFIX.glob("python3*/site-packages"))
    environment = os.environ | {
        "LD_LIBRARY_PATH": str(PREFIX),
        "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]),
    }
    done = subprocess.run(
        [sys.executable, __file__],
        input=json.dumps({"cases": cases, "edges": edges}),
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    # the library itself writes to standard output, too
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    import hpp_centroidal_dynamics as centroidal
    import numpy as np

    asked = json.load(sys.stdin)
    found: list[float | None] = []
    for case in asked["cases"]:
        problem = centroidal.Equilibrium(
            "contacts", case["mass"], asked["edges"], centroidal.SOLVER_LP_QPOASES
        )
        assert problem.setNewContacts(
            np.asfortranarray(case["points"], dtype=float),
            np.asfortranarray(case["normals"], dtype=float),
            float(case["friction"]),
            centroidal.EQUILIBRIUM_ALGORITHM_LP,
        )
        status, margin = problem.computeEquilibriumRobustness(np.array(case["com"], dtype=float))
        found.append(float(margin) if status == centroidal.LP_STATUS_OPTIMAL else None)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
