"""One file of HTML: data, style, script, and the library that draws in three dimensions."""

from __future__ import annotations

import gzip
from base64 import b64encode
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec

from hand_models.base import UnsupportedError, to_install, whole_file
from planner.pictures import PICTURE_SETTINGS

__all__ = ["document", "write_document"]


def document(title: str, data: dict[str, Any]) -> str:
    """Return a page that shows data, as HTML that loads nothing else.

    Parameters
    ----------
    title : str
        Title of the page.
    data : dict of str to object
        What ``page.js`` shows; with ``live``, ``live.js`` lets a person change it.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise UnsupportedError(
            f"a page needs plotly, which is not installed: {to_install('view')}"
        ) from None
    packed = b64encode(gzip.compress(get_plotlyjs().encode(), mtime=0)).decode()
    colours = {
        "utilisation": PICTURE_SETTINGS.utilisation,
        "overload": PICTURE_SETTINGS.overload,
        "dark_overload": PICTURE_SETTINGS.dark_overload,
    }
    text = msgspec.json.encode(data | {"title": title, "colours": colours}).decode()
    parts = {
        "title": escape(title),
        "style": _part("page.css"),
        "plotly": packed,
        "data": text.replace("<", "\\u003c"),
        "script": _part("page.js")
        + _part("labels.js")
        + (_part("live.js") if "live" in data else "\nstart().catch(unable);\n"),
    }
    page = _part("page.html")
    for name, part in parts.items():
        before, after = page.split(f"{{{{{name}}}}}", 1)
        page = before + part + after
    return page


def write_document(title: str, data: dict[str, Any], path: Path) -> None:
    """Write a page as `document` returns it to a file, whole or not at all."""
    text = document(title, data)
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")


def _part(name: str) -> str:
    return (resources.files("planner.pages") / name).read_text(encoding="utf-8")
