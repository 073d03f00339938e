"""Draw what the body of ``wall-300`` can bear, in two rows: ``python docs/draw_body.py``."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

PICTURE = Path(__file__).parent / "body.png"
ASKED = ("body-space", "wall-300", "--axes", "fx,fz")
HEADING = 0.065
"""Share of the picture's height that its two lines of heading take."""

CUTS = (0.3355, 0.671)
"""Where one view ends and the next begins, as shares of the picture's width."""


def main() -> None:
    """Let the command draw its three views in one row, and write them in two."""
    with TemporaryDirectory() as folder:
        row = Path(folder) / "row.png"
        run = "from service.__main__ import main; main()"
        subprocess.run([sys.executable, "-c", run, *ASKED, "--plot", str(row)], check=True)
        image = plt.imread(row)
    height, width, _ = image.shape
    views = np.split(image[round(HEADING * height) :], [round(c * width) for c in CUTS], axis=1)
    cell = max(view.shape[1] for view in views)
    views = [
        np.pad(view, ((0, 0), (0, cell - view.shape[1]), (0, 0)), constant_values=1.0)
        for view in views
    ]
    rows = np.hstack(views[:2]), np.hstack([views[2], np.ones_like(views[2])])
    plt.imsave(PICTURE, np.ascontiguousarray(np.vstack(rows)))


if __name__ == "__main__":
    main()
