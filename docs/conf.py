"""Sphinx's configuration. ``sphinx-build -W docs build/docs`` builds the pages."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode, document, image
from latex2mathml.converter import convert as latex_to_mathml

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from generation import write_all  # noqa: E402 - found by the line above

project = "crux"
author = "The crux authors"
copyright = f"2026 {author}"  # as in LICENSE
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
html_math_renderer = "mathml"
smartquotes = False  # which would make a dash of --hand
html_theme = "furo"
html_title = f"crux {release}"
html_static_path = ["style"]
html_css_files = ["crux.css"]
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


def inline_formula(translator: Any, node: Any) -> None:
    """Write a formula within a sentence as MathML, which browsers show without a script."""
    translator.body.append(latex_to_mathml(node.astext()))
    raise SkipNode


def display_formula(translator: Any, node: Any) -> None:
    """Write a formula on a line of its own as MathML."""
    formula = latex_to_mathml(node.astext(), display="block")
    translator.body.append(f'<div style="margin: 0.8em 0">{formula}</div>')
    raise SkipNode


def link_pictures(app: Any, page: document) -> None:
    """Give every picture the page's width, so that Sphinx links it to its full size."""
    for picture in page.findall(image):
        picture["width"] = "100%"


def setup(app: Any) -> None:
    """Take part in what autodoc does, link pictures and write formulas."""
    app.connect("autodoc-skip-member", skip_alias)
    app.connect("doctree-read", link_pictures)
    app.add_html_math_renderer("mathml", (inline_formula, None), (display_formula, None))


write_all(HERE / "reference" / "generated")
