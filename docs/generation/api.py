"""Pages of the Python interface: what the packages' and rooms' indices export."""

from __future__ import annotations

import importlib
import inspect
from types import ModuleType
from typing import Any

__all__ = ["api_pages"]

ROOMS = {
    "hand_models": (
        "rock",
        "scans",
        "hand",
        "fixed_wrist",
        "compliance",
        "wrench_spaces",
        "tile",
        "tendon",
        "finger",
        "parameters",
        "studies",
        "base",
    ),
    "planner": (
        "question",
        "result",
        "robots",
        "advice",
        "route",
        "motion",
        "reach",
        "screening",
        "certification",
        "capability",
        "streaming",
        "scene",
        "verification",
        "deadline",
        "pictures",
    ),
    "service": (
        "requests",
        "replies",
        "serving",
        "publishing",
        "processes",
        "bulk",
        "sweeping",
        "wire",
    ),
}
"""Rooms that a caller imports from; the others are told of in the page on the architecture."""


def api_pages() -> dict[str, str]:
    """Return a page for each package and room, and one that lists them."""
    pages, entries = {}, []
    for package, rooms in ROOMS.items():
        index = importlib.import_module(package)
        known = [getattr(index, name) for name in index.__all__]
        for module, skipped in [
            (index, []),
            *((importlib.import_module(f"{package}.{room}"), known) for room in rooms),
        ]:
            pages[f"api/{module.__name__}.rst"] = _page(module, skipped)
            entries.append(module.__name__)
    lines = ["# Python", "", "The names that packages and their rooms export.", "", "```{toctree}"]
    pages["api/index.md"] = "\n".join([*lines, ":maxdepth: 1", "", *entries, "```", ""])
    return pages


def _page(module: ModuleType, skipped: list[Any]) -> str:
    name = module.__name__
    text = [name, "=" * len(name), "", f".. automodule:: {name}", "   :no-members:", ""]
    text += [f".. currentmodule:: {name}", ""]
    package = name.partition(".")[0]
    values = {member: getattr(module, member) for member in sorted(module.__all__)}
    known = [member for member, value in values.items() if any(value is one for one in skipped)]
    if known:
        links = ", ".join(f":obj:`{package}.{member}`" for member in known)
        text += [f"Described with the package: {links}.", ""]
    for member in [member for member in values if member not in known]:
        value = values[member]
        if inspect.isclass(value):
            text += [f".. autoclass:: {member}", "   :members:", "   :show-inheritance:", ""]
        elif inspect.isroutine(value):
            text += [f".. autofunction:: {member}", ""]
    return "\n".join(text)
