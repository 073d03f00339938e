"""The name that this distribution has where packages are installed, and its version."""

from __future__ import annotations

from typing import Final

__all__ = ["DISTRIBUTION_NAME", "installed_version", "to_install"]

DISTRIBUTION_NAME: Final = "crux-climb"
"""The name ``crux`` belongs to another project on PyPI."""


def installed_version(package: str = DISTRIBUTION_NAME) -> str | None:
    """Return the version of a distribution; None where it is not installed."""
    # which takes long to load, and ``--help`` does without it
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return None


def to_install(extra: str) -> str:
    """Return in words how an extra of this distribution is installed."""
    return f"in a checkout of {DISTRIBUTION_NAME}, pip install -e '.[{extra}]'"
