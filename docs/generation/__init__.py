"""Pages of the reference that are made from the code when the documents are built."""

from __future__ import annotations

from pathlib import Path

from generation.api import api_pages
from generation.layouts import layout_page
from generation.messages import message_page
from generation.notebook import notebook_page
from generation.parameters import parameter_page
from generation.transcripts import key_pages
from generation.turned import TURNED, turned_pages

__all__ = ["TURNED", "write_all"]


def write_all(folder: Path) -> None:
    """Write every generated page into a folder; files that would stay the same are not touched."""
    pages: dict[str, bytes] = {
        "first_climb.md": notebook_page().encode(),
        "messages.md": message_page().encode(),
        "parameters.md": parameter_page().encode(),
    }
    pages |= {name: text.encode() for name, text in api_pages().items()}
    pages |= key_pages()
    pages["layouts.md"] = layout_page(pages).encode()
    pages |= {f"turned/{name}": content for name, content in turned_pages().items()}
    for name, content in pages.items():
        file = folder / name
        if not file.is_file() or file.read_bytes() != content:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
    for file in [file for file in folder.rglob("*") if file.is_file()]:
        if str(file.relative_to(folder)) not in pages:
            file.unlink()
