"""Say what a replay has found: how many answers are equal, and which fields have moved."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hand_models.base import installed_version
from service.recording import Moved, Recording, Replay
from service.tables import counted, name, note, number, print_rows, text

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["note_losses", "print_replay", "replay_json"]


def note_losses(recording: Recording, file: Path) -> None:
    """Note on standard error what of a recording's file could not be read."""
    if recording.whole is False:
        note(
            f"{file} was cut off or is damaged after byte {recording.read:,}; all that is whole "
            "before it has been replayed"
        )
    if recording.damaged:
        whole = "" if recording.whole else " so far"
        note(
            f"{file} is damaged: {recording.damaged:,} of {counted(recording.chunks, 'chunk')}"
            f"{whole} cannot be read, and their questions are left out"
        )


def replay_json(replay: Replay) -> dict[str, Any]:
    """Return the result of a replay as plain data."""
    return {
        "v": 1,
        "recorded": replay.recording.about["version"],
        "replayed": installed_version(),
        "whole": replay.recording.whole,
        "damaged": replay.recording.damaged,
        "chunks": replay.recording.chunks,
        "asked": replay.asked,
        "equal": replay.equal,
        "within_gap": replay.near,
        "moved": replay.moved,
        "left_out": replay.left_out,
        "skipped": replay.skipped,
        "fields": [
            {
                "answer": each.kind,
                "field": each.field,
                "answers": each.answers,
                "question": each.number,
                "path": each.most.path,
                "old": each.most.old,
                "new": each.most.new,
            }
            for each in _ordered(replay)
        ],
    }


def print_replay(replay: Replay, out: Console) -> None:
    """Print the result of a replay: a sentence, and a table of the fields that have moved.

    Parameters
    ----------
    replay : Replay
    out : Console
    """
    about, here = replay.recording.about["version"] or "unknown", installed_version() or "unknown"
    total = replay.equal + replay.near + replay.moved
    kinds = ", ".join(f"{count:,} {kind}" for kind, count in sorted(replay.asked.items()))
    out.print(
        f"{counted(total, 'question')} of version {about} asked again of version {here}"
        + (f": {kinds}" if kinds else ""),
        markup=False,
    )
    lines = {
        "equal to the digit": replay.equal,
        "equal within their proven gaps: which plans a stream interpolates depends on time": (
            replay.near
        ),
        "moved": replay.moved,
        "not asked, as their answers depend on more than the question": replay.left_out,
        "skipped by the service for newer wrenches, so there are no answers": replay.skipped,
    }
    for words, count in lines.items():
        if count or words.startswith("equal to"):
            out.print(f"{count:,} {words}", markup=False)
    rows = _ordered(replay)
    most = 20
    more = [f"and {counted(len(rows) - most, 'more field')}: --json"] if len(rows) > most else []
    if rows:
        print_rows(rows[:most], MOVED_COLUMNS, out, "Fields that have moved most", legend=more)


def _ordered(replay: Replay) -> list[Moved]:
    """Return what has moved, by most first."""
    return sorted(replay.fields.values(), key=lambda each: -each.most.size)


def _value(value: Any) -> str:
    """Return a value as text, not too long."""
    said, longest = f"{value:.5g}" if isinstance(value, float) else str(value), 18
    return said if len(said) <= longest else f"{said[:longest]}…"


def _words(field: str) -> str:
    """Return a path as words, so that a narrow column can part it."""
    return field.replace("[]", "").replace(".", " ")


def _size(moved: Moved) -> str | None:
    return None if math.isinf(moved.most.size) else f"{moved.most.size:.1e}"


MOVED_COLUMNS = (
    text("answer: field", lambda each: f"{each.kind}: {_words(each.field)}"),
    number("in", "answers", ",d"),
    number("by", _size),
    name("old → new", lambda each: f"{_value(each.most.old)} → {_value(each.most.new)}"),
    number("question", "number", ",d"),
)
