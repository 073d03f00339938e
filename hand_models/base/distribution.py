"""Name of this distribution for package installers, and versions of installed distributions."""

from __future__ import annotations

from typing import Final

__all__ = ["DISTRIBUTION_NAME", "installed_version", "to_install"]

DISTRIBUTION_NAME: Final = "crux-climb"
"""Name of this distribution; ``crux`` belongs to another project on PyPI."""


def installed_version(package: str = DISTRIBUTION_NAME) -> str | None:
    """Return the version of the installed distribution ``package``; None if it is not installed."""
    # which takes long to load, and ``--help`` does without it
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return None


def to_install(extra: str) -> str:
    """Return the instruction by which a user installs the optional dependencies ``extra``."""
    return f"in a checkout of {DISTRIBUTION_NAME}, pip install -e '.[{extra}]'"
