"""The whole table of benchmarks: ``python -m tests.benchmarks``, from a checkout."""

import sys
from pathlib import Path

if __name__ == "__main__":
    here = Path(__file__).resolve().parent
    # where pytest finds what the benchmarks share, too
    sys.path[:0] = [str(here), str(here.parent)]
    from benchmark_command import main

    main(prog_name="python -m tests.benchmarks")
