"""The table of the suite: ``python -m tests.suite``, from a checkout."""

import sys
from pathlib import Path

if __name__ == "__main__":
    # where pytest finds what the tests share, too
    sys.path[:0] = [str(Path(__file__).resolve().parents[1])]
    from suite.table import main

    main(prog_name="python -m tests.suite")
