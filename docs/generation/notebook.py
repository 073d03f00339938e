"""The notebook of ``examples`` as a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

__all__ = ["notebook_page"]

NOTEBOOK: Final = Path(__file__).parents[2] / "examples" / "first_climb.ipynb"


def notebook_page() -> str:
    """Return the notebook's texts and code, in order, with the notebook itself to download."""
    parts = []
    for cell in json.loads(NOTEBOOK.read_text("utf-8"))["cells"]:
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(text.replace("](../docs/", "](../../"))
        elif text.startswith("!"):
            parts.append(f"```sh\n{text[1:]}\n```")
        else:
            parts.append(f"```python\n{text}\n```")
    heading, *rest = parts
    download = "{download}`The notebook <../../../examples/first_climb.ipynb>`"
    return "\n\n".join([heading, download, *rest, ""])
