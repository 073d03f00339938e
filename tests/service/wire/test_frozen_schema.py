"""The wire is as it was: the schemas of requests and replies, field by field, are kept as files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from service.wire import schema

KEPT = Path(__file__).parent

RENEW = (
    "the wire has changed: if it is meant to, write the new lines with "
    "`python -m tests.service.wire.test_frozen_schema`"
)


def lines_of(message: str) -> list[str]:
    """One line for each field of the messages of a kind and of their parts, without descriptions.

    ``message``: how the names of the messages end, such as ``Request``.
    """
    parts = schema()["$defs"]
    wanted = sorted(name for name in parts if name.endswith(message))
    for name in wanted:
        found = json.dumps(parts[name]).split("#/$defs/")[1:]
        wanted += sorted({each.split('"')[0] for each in found} - {*wanted})
    return [line for name in sorted(wanted) for line in _lines(name, parts[name])]


def _lines(name: str, part: dict[str, Any]) -> list[str]:
    whole = {key: value for key, value in part.items() if key not in ("properties", "title")}
    fields = part.get("properties", {})
    return [f"{name} {_text(whole)}", *(f"{name}.{key} {_text(fields[key])}" for key in fields)]


def _text(part: Any) -> str:
    return json.dumps(_bare(part), ensure_ascii=False, sort_keys=True)


def _bare(part: Any) -> Any:
    if isinstance(part, dict):
        return {key: _bare(value) for key, value in part.items() if not _left_out(key, value)}
    return [_bare(each) for each in part] if isinstance(part, list) else part


def _left_out(key: str, value: Any) -> bool:
    """Words, and which keys a mapping has: msgspec says these since version 0.23."""
    return key == "description" or (key == "propertyNames" and "enum" in value)


FILES = {"Request": KEPT / "requests.schema", "Reply": KEPT / "replies.schema"}


def test_no_field_is_lost_or_changed() -> None:
    for message in FILES:
        kept = FILES[message].read_text(encoding="utf-8").splitlines()
        now = lines_of(message)
        gone = [f"- {line}" for line in kept if line not in now]
        new = [f"+ {line}" for line in now if line not in kept]
        assert not gone + new, "\n".join([RENEW, *gone, *new])
        assert now == kept, f"the order of fields has changed; {RENEW}"


if __name__ == "__main__":
    for ending, file in FILES.items():
        file.write_text("\n".join(lines_of(ending)) + "\n", encoding="utf-8")
