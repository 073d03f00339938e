"""Figures that can be turned: pages of plans and climbs, which share the library that draws."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

__all__ = ["TURNED", "turned_pages"]

LIBRARY: Final = re.compile(r'(<script type="text/plain" id="plotly">)([^<]*)(</script>)')
"""Where a page has the library, packed as text."""

LIBRARY_NAME: Final = "turned-library.js"


class _Turned(NamedTuple):
    """A page by its file, and the command that writes it to the file ``page.html``."""

    name: str
    command: str


TURNED: Final = {
    "demo": _Turned("turned-plan.html", "plan wall-300-joints --html page.html"),
    "climb": _Turned("turned-route.html", "route knobs --html page.html"),
    "knob-wall": _Turned("turned-climb.html", "demo --climb out --html page.html"),
    "hand": _Turned("turned-boulders.html", "plan boulders --html page.html"),
}
"""Pages that can be turned, by the names of the still pictures that show the same."""


def turned_pages() -> dict[str, bytes]:
    """Return the pages and the library that they share, by the names of their files."""
    pages: dict[str, bytes] = {}
    for turned in TURNED.values():
        text = _written(turned.command)
        found = LIBRARY.search(text)
        if found is None:
            raise RuntimeError(f"crux {turned.command}: a page without the library that draws")
        filled = f'document.getElementById("plotly").textContent = "{found[2]}";\n'
        pages[LIBRARY_NAME] = filled.encode()
        shared = f'{found[1]}{found[3]}\n<script src="{LIBRARY_NAME}"></script>'
        pages[turned.name] = (text[: found.start()] + shared + text[found.end() :]).encode()
    return pages


def _written(command: str) -> str:
    """Return the page that a command of ``crux`` writes."""
    run = "from service.__main__ import main; main()"
    with TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", run, *shlex.split(command)],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        page = Path(folder) / "page.html"
        if not page.is_file():
            raise RuntimeError(f"crux {command}: {done.stderr}")
        return page.read_text("utf-8")
