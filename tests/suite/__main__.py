"""The table of the suite: ``python -m tests.suite``, from a checkout."""

from tests.suite.table import main

if __name__ == "__main__":
    main(prog_name="python -m tests.suite")
