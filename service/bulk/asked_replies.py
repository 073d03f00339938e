"""Replies of a bulk run as lines that also keep what was asked, so that no other run goes on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from hand_models.base import InvalidInputError
from service.bulk.headers import Header
from service.bulk.lines import Asked
from service.bulk.runs import AnswerOutcome, ReplyLines, question_digest

__all__ = ["AskedReplies"]


class _Kept(msgspec.Struct):
    """Digests of the fields of a question in the line of its answer; none of one never read."""

    id: str | None = None
    asked: dict[str, str] | None = None


class AskedReplies(ReplyLines):
    """Replies as lines of JSON; each has digests of what was asked in the field ``asked``.

    Parameters
    ----------
    file : Path
        File of the lines.
    header : Header
        Identifies the run: version, robot and explanations are kept in each line, too.
    resume : bool
        True to keep the lines of an existing file, and to continue after them.
    asked : Asked
        All requests of the run, including those that the file answers.
    named : mapping of str to str
        Names of a request's fields in errors, such as options; others have their own name.
    """

    def __init__(
        self, file: Path, header: Header, resume: bool, asked: Asked, named: Mapping[str, str]
    ) -> None:
        about = {"crux": header.crux, "robot_file": header.robot, "explain": header.explain}
        self._about = {
            name: question_digest(msgspec.json.encode(each)) for name, each in about.items()
        }
        own = {"crux": "version of crux", "robot_file": "--robot", "explain": "--no-explain"}
        self._named = own | dict(named)
        super().__init__(file, False, resume, asked)

    def _line(self, question: bytes, payload: bytes, seconds: float) -> tuple[bytes, AnswerOutcome]:
        line, outcome = super()._line(question, payload, seconds)
        kept = msgspec.json.encode(self._asked(question))
        return line.removesuffix(b"}\n") + b',"asked":' + kept + b"}\n", outcome

    def _read_line(self, line: bytes, question: bytes, where: str) -> AnswerOutcome:
        outcome = super()._read_line(line, question, where)
        kept, now = msgspec.json.decode(line, type=_Kept), self._asked(question)
        if kept.asked is None:
            raise InvalidInputError(
                f"{where}: does not say what was asked, as those of older versions; start again "
                "without --resume",
                field="--resume",
            )
        # of what could not be read, the error stands whatever is asked
        names = [name for name in kept.asked | now if kept.asked.get(name) != now.get(name)]
        if kept.asked and names:
            others = " and ".join(dict.fromkeys(self._named.get(name, name) for name in names))
            if not now:
                others = "content, which cannot be read now"
            raise InvalidInputError(
                f"{where}: answers {kept.id!r} with another {others}; give that again, or start "
                "again without --resume",
                field="--resume",
            )
        return outcome

    def _asked(self, question: bytes) -> dict[str, str]:
        """Return a digest of each field of a question; none of one that could not be read."""
        fields = msgspec.json.decode(question, type=dict[str, msgspec.Raw])
        if "error" in fields:
            return {}
        return {name: question_digest(bytes(raw)) for name, raw in fields.items()} | self._about
