"""The whole table of benchmarks: ``python -m tests.benchmarks``, from a checkout."""

from tests.benchmarks.benchmark_command import main

if __name__ == "__main__":
    main(prog_name="python -m tests.benchmarks")
