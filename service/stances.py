"""Where the command line finds a stance: a file, standard input, or one of the bundled ones."""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path

from hand_models.errors import InvalidInputError
from service.codec import decode_request
from service.requests import PlanRequest

__all__ = ["bundled", "read_request"]


def bundled() -> tuple[str, ...]:
    """Return the names of the bundled stances."""
    folder = resources.files("service") / "examples"
    return tuple(sorted(Path(f.name).stem for f in folder.iterdir() if f.name.endswith(".json")))


def read_request(source: str) -> PlanRequest:
    """Return the plan request that a command was given.

    Parameters
    ----------
    source : str
        Path of a JSON file, ``-`` for standard input, or the name of a bundled stance.

    Raises
    ------
    InvalidInputError
        If there is none, or it is not a plan request.
    """
    if source == "-":
        return decode_request(sys.stdin.buffer.read(), PlanRequest)
    path = Path(source)
    if path.is_file():
        try:
            return decode_request(path.read_bytes(), PlanRequest)
        except OSError as error:
            raise InvalidInputError(f"{error.strerror}: {source}", field="STANCE") from None
    if source in bundled():
        text = resources.files("service") / "examples" / f"{source}.json"
        return decode_request(text.read_bytes(), PlanRequest)
    raise InvalidInputError(
        f"no such file, and no bundled stance {source!r}; bundled are {', '.join(bundled())}",
        field="STANCE",
    )
