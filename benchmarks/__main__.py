"""The whole table of benchmarks: ``python -m benchmarks``, from a checkout."""

from benchmarks.benchmark_command import main

if __name__ == "__main__":
    main(prog_name="python -m benchmarks")
