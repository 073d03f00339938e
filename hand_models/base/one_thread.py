"""Do linear algebra on one thread, so that all processes add up in the same order."""

from __future__ import annotations

import os
from typing import Final

__all__ = ["THREAD_VARIABLES", "use_one_thread"]

THREAD_VARIABLES: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit a linear-algebra library to one thread, when it loads."""


def use_one_thread() -> None:
    """Let this process do its linear algebra on one thread, unless its environment says how many.

    To be called before NumPy is loaded. Matrices are small here: more threads gain nothing, but
    change the last digits.
    """
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
