"""Sphinx's configuration. ``sphinx-build -W docs build/docs`` builds the pages."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from generation import write_all  # noqa: E402 - found by the line above

project = "crux"
author = "The crux authors"
release = version = tomllib.loads((HERE.parent / "pyproject.toml").read_text("utf-8"))["project"][
    "version"
]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx_click",
]
myst_enable_extensions = ["dollarmath"]
smartquotes = False  # which would make a dash of --hand
html_theme = "furo"
html_title = f"crux {release}"
exclude_patterns = ["reference/generated/bytes"]

myst_heading_anchors = 3
default_role = "py:obj"
add_module_names = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False


def skip_alias(app: Any, what: str, name: str, value: Any, skip: bool, options: Any) -> bool:
    """Leave out what Python itself says of the fields of a named tuple."""
    return skip or (value.__doc__ or "").startswith("Alias for field number")


def setup(app: Any) -> None:
    """Take part in what autodoc does."""
    app.connect("autodoc-skip-member", skip_alias)


write_all(HERE / "reference" / "generated")
