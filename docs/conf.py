"""Sphinx's configuration. ``sphinx-build -W docs build/docs`` builds the pages."""

from __future__ import annotations

import sys
import tomllib
from html import escape
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode, document, image, raw
from latex2mathml.converter import convert as latex_to_mathml

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from generation import TURNED, write_all  # noqa: E402 - found by the line above

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
html_static_path = ["style", "reference/generated/turned"]
html_css_files = ["crux.css"]
html_show_search_summary = False  # it would fetch pages, which file:// refuses
exclude_patterns = ["reference/generated/bytes", "reference/generated/turned"]

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


TURN_IT = """<details class="turned"><summary>Turn it</summary>
<iframe src="{0}" title="{1}" loading="lazy"></iframe>
<p><a href="{0}">Open it alone</a></p></details>"""
"""HTML below a picture of which there is a page that can be turned; it is loaded once opened."""


def add_turned(app: Any, page: document, name: str) -> None:
    """Add, below still pictures, the pages of the same figures that can be turned."""
    for picture in list(page.findall(image)):
        turned = TURNED.get(Path(picture["uri"]).stem)
        if turned and app.builder.format == "html":
            address = f"{'../' * name.count('/')}_static/{turned.name}"
            words = escape(picture.get("alt", ""))
            node = raw("", TURN_IT.format(address, words), format="html")
            link: Any = picture.parent
            link.parent.insert(link.parent.index(link) + 1, node)


def setup(app: Any) -> None:
    """Take part in what autodoc does, link and turn pictures, write formulas."""
    app.connect("autodoc-skip-member", skip_alias)
    app.connect("doctree-read", link_pictures)
    app.connect("doctree-resolved", add_turned)
    app.add_html_math_renderer("mathml", (inline_formula, None), (display_formula, None))


write_all(HERE / "reference" / "generated")
