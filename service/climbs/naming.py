"""Name options of ``crux climb`` in errors, in the place of the fields of the request."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from typing import Final

from hand_models.base import CruxError
from service.replies import ErrorDetail, ErrorReply
from service.wire import Answer, Format

__all__ = ["FIELD_OPTIONS", "naming_options", "with_options"]

FIELD_OPTIONS: Final = {
    "rock": "ROCK (or --lean)",
    "start": "--from (or --radius)",
    "goal": "--to (or --radius)",
    "places": "--spacing",
    "bodies": "--body-spacing (or --stand-off)",
    "surface": "--surface",
    "best_within": "--best-within",
    "at_least": "--at-least",
    "time": "--time",
    "refine": "--refine",
    "wrist": "--wrist",
    "wrist_travel": "--wrist-travel",
    "hand": "--hand",
    "robot": "--robot",
}
"""Options of ``crux climb`` by the fields of a request that are made of them."""


@contextmanager
def naming_options() -> Iterator[None]:
    """Let errors about a request for a climb name its options, as a context manager."""
    try:
        yield
    except CruxError as error:
        _name_options(error)
        raise


def with_options(
    answers: Generator[Answer, None, None],
) -> Generator[Answer, None, None]:
    """Yield answers to requests for climbs in JSON; errors among them name options."""
    with closing(answers):
        for answer in answers:
            if answer.good:
                yield answer
                continue
            reply = Format.JSON.decode(answer.payload, ErrorReply)
            _name_options(reply.error)
            yield answer._replace(payload=Format.JSON.encode(reply))


def _name_options(error: CruxError | ErrorDetail) -> None:
    """Replace the field of an error, and a field in brackets in its message, by options."""
    options = {
        "places.spacing": "--spacing",
        "bodies.spacing": "--body-spacing",
        "bodies.stand_offs": "--stand-off",
        "bodies.sample": "ROCK",
        "file": "ROCK",
        "rock": "ROCK",
        "surface": "--surface",
        "start": "--from",
        "goal": "--to",
        "time": "--time",
        "wrist_travel": "--wrist-travel",
        "wrist": "--wrist",
    }
    for path, option in options.items():
        error.message = error.message.replace(f"({path})", f"({option})")
        before, _, rest = (error.field or "").partition(path)
        if error.field and not before and rest[:1] in ("", "."):
            further = rest[1:]
            error.field = f"{option}: {further}" if further.startswith("hands") else option
