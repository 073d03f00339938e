"""The page of all physical numbers, from the files that have them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any

from generation.tables import table

__all__ = ["parameter_page"]

FILES = {
    "hand_models.parameters": (
        "hand.toml",
        "surfaces.toml",
        "spines.toml",
        "strength.toml",
        "scan.toml",
        "experiments.toml",
        "draws.toml",
    ),
    "planner.parameters": (
        "robosimian.toml",
        "scene.toml",
        "plans.toml",
        "climb.toml",
        "slips.toml",
        "diagnosis.toml",
    ),
}

SHOWN = 6
"""Of a longer list its count and its range are told."""

BEGINNING = """# Parameters

Every physical number that the models use, from the files that have it. SI units.

| kind | means |
| --- | --- |
| `paper` | printed in the paper |
| `measured` | taken from the published CAD or robot model |
| `calibrated` | fitted to the paper's figures |
| `assumed` | nothing is published; the source says why this value |

To change a number of the hand, see [your own hand](../../tutorial/hand.md); of the robot,
[your robot](../../tutorial/robot.md).
"""


def parameter_page() -> str:
    """Return the page."""
    text = [BEGINNING]
    for package, names in FILES.items():
        for name in names:
            content = resources.files(package).joinpath(name).read_text(encoding="utf-8")
            text.append(f"## {name}\n\n`{package.replace('.', '/')}/{name}`\n")
            for section, entries in _sections(tomllib.loads(content)):
                rows = [
                    (f"`{entry}`", _number(q["value"]), q["unit"], q["source"], q.get("note", ""))
                    for entry, q in entries.items()
                ]
                text.append(f"### {name}: {section}\n")
                text.append(table(("entry", "value", "unit", "kind", "source"), rows))
    return "\n".join(text)


def _sections(raw: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield sections and their quantities; what is no quantity (a name) is left out."""
    own = {k: v for k, v in raw.items() if isinstance(v, Mapping) and "value" in v}
    if own:
        yield path, own
    for name, value in raw.items():
        if isinstance(value, Mapping) and "value" not in value:
            yield from _sections(value, f"{path}.{name}" if path else name)


def _number(value: float | list[float]) -> str:
    if not isinstance(value, list):
        return f"{value:.10g}"
    if len(value) <= SHOWN:
        return ", ".join(f"{v:.10g}" for v in value)
    return f"{len(value)} numbers, {min(value):.6g} to {max(value):.6g}"
