"""The page of all messages, from their JSON Schema and their classes' own words."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

from generation.tables import table
from hand_models.parameters import Quantity
from service.wire.json_schema import MESSAGE_KINDS, part_name, schema

__all__ = ["anchor", "message_page"]

Schema = Mapping[str, Any]

BOUNDS = {
    "minimum": "≥",
    "exclusiveMinimum": ">",
    "maximum": "≤",
    "exclusiveMaximum": "<",
    "maxLength": "characters ≤",
    "minItems": "entries ≥",
    "maxItems": "entries ≤",
    "maxProperties": "entries ≤",
}

FIELD = re.compile(r"(?:\A|(?<=[.;])\s)(?=`[a-z_]+`(?:(?:,| and)\s`[a-z_]+`)*: )")
"""Where the words about a field begin, which get a line of their own."""

BEGINNING = """# Messages

Every message of the service, from the JSON Schema that `crux schema` prints. Requests are strict:
an unknown or missing field is an error. Replies may gain fields; ignore unknown ones.
MessagePack has the same structure: an object is a map with the field names as keys.

Frames: W world, B body, H hand, see [frames, signs and units](../frames.md).
"""


def anchor(name: str) -> str:
    """Return the label of a message or of a part of one."""
    return "message-" + name.lower()


def message_page() -> str:
    """Return the page."""
    told = schema()
    parts, words = told["$defs"], dict(_words())
    wholes = [kind.__name__ for kind in MESSAGE_KINDS]
    text = [BEGINNING]
    for heading, names in (
        ("Whole messages", wholes),
        ("Their parts", sorted(name for name in parts if name not in wholes)),
    ):
        text.append(f"## {heading}\n")
        text += [_section(name, parts[name], words.get(name, "")) for name in names]
    return "\n".join(text)


def _words() -> Iterator[tuple[str, str]]:
    """Yield what the docstring of each part says beyond its first sentence."""
    seen = msgspec.inspect.multi_type_info((*MESSAGE_KINDS, Quantity))
    structs: set[type] = set()
    stack: list[Any] = list(seen)
    while stack:
        info = stack.pop()
        if isinstance(info, msgspec.inspect.StructType):
            if info.cls in structs:
                continue
            structs.add(info.cls)
            stack += [field.type for field in info.fields]
        stack += [
            part
            for name in ("type", "item_type", "value_type", "types", "item_types")
            for value in [getattr(info, name, ())]
            for part in (value if isinstance(value, tuple) else [value])
        ]
    for kind in structs:
        rest = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[2]
        plain = rest.partition("\nAttributes\n")[0]
        words = "" if rest.startswith("Attributes") else plain.replace("``", "`")
        yield part_name(kind.__name__), words


def _section(name: str, part: Schema, words: str) -> str:
    required = part.get("required", [])
    rows = [
        (f"`{field}`", _type(entry), _need(field, entry, required), _meaning(entry))
        for field, entry in part.get("properties", {}).items()
    ]
    shown = 4 if any(meaning for *_, meaning in rows) else 3
    fields = table(("field", "type", "needed", "meaning")[:shown], [row[:shown] for row in rows])
    title, about = f"({anchor(name)})=\n### {name}\n", part.get("description", "")
    return "\n".join([title, about, "", FIELD.sub("\n- ", words), "", fields])


def _need(field: str, entry: Schema, required: list[str]) -> str:
    if field in required or entry.get("enum") == [1]:
        return "yes"
    if "default" in entry and entry["default"] is not None:
        return f"`{json.dumps(entry['default'], ensure_ascii=False)}`"
    return "no"


def _meaning(entry: Schema) -> str:
    said = [entry.get("description", "")]
    said += [part.get("description", "") for part in entry.get("anyOf", [])]
    texts = list(dict.fromkeys(filter(None, said)))
    # what another text has, such as a unit, is told once
    return "; ".join(
        text for text in texts if not any(text in other for other in texts if other != text)
    )


def _type(entry: Schema) -> str:
    """Return the words for a type, with its bounds."""
    if "$ref" in entry:
        name = entry["$ref"].rpartition("/")[2]
        return f"[{name}](#{anchor(name)})"
    if "anyOf" in entry:
        return " or ".join(dict.fromkeys(map(_type, entry["anyOf"])))
    if "enum" in entry:
        return ", ".join(f"`{json.dumps(value)}`" for value in entry["enum"])
    kind = entry.get("type", "anything")
    if kind == "array" and "prefixItems" in entry:
        items = [_type(item) for item in entry["prefixItems"]]
        alike = len(set(items)) == 1
        return f"[{len(items)} × {items[0]}]" if alike else f"[{', '.join(items)}]"
    if kind == "array":
        kind = f"list of {_type(entry.get('items', {}))}"
    elif kind == "object" and isinstance(entry.get("additionalProperties"), Mapping):
        kind = f"object, of names to {_type(entry['additionalProperties'])}"
    bounds = [f"{sign} {entry[key]:.10g}" for key, sign in BOUNDS.items() if key in entry]
    return f"{kind} ({', '.join(bounds)})" if bounds else str(kind)
