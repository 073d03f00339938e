"""Count what makes the code and its documents hard to read; fail where a count exceeds its limit.

``python .ci/words.py`` prints each count with its limit; ``-v`` also prints where. A limit is
lowered when its count has fallen, and never raised.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("hand_models", "planner", "service")

LIMITS = {
    "docstrings that are fragments": 0,
    "old words in the source": 4,
    "old words in the documents": 2,
    "module constants of one word": 16,
    "public names defined twice": 2,
    "public names defined twice without a reason": 0,
    "reasons for names that are not defined twice": 0,
    "table cells above 25 words": 0,
}
"""The largest number of each that passes."""

DEFINED_TWICE = {
    "plot": "every study has it",
    "run": "every study has it",
}
"""Why a public name may be defined twice."""

FRAGMENT = re.compile(
    r"(Of|As|By|What|Whose|How|So|Which|Where|Whether|Than|Besides?|Beyond|From|To|In|On|At|With|Without)\b"
)
"""How a docstring begins that neither starts with a verb nor names a thing."""

OLD_WORDS = re.compile(
    r"\b(told|tells|tell|hangs on|stillborn|bury|buried|dismiss(?:ed)?|hire[sd]?)\b", re.IGNORECASE
)
"""Words for which the glossary of the documents has the field's own."""

WORDS_IN_A_CELL = 25


def sources() -> Iterator[tuple[str, ast.Module, str]]:
    """Yield path, syntax tree and text of every module of the packages."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            text = path.read_text("utf-8")
            yield str(path.relative_to(ROOT)), ast.parse(text), text


def documents() -> Iterator[tuple[str, str]]:
    """Yield path and text of every page that is written by hand."""
    for path in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]):
        if "generated" not in path.parts:
            yield str(path.relative_to(ROOT)), path.read_text("utf-8")


def found() -> dict[str, list[str]]:
    """Return the places of everything that is counted."""
    places: dict[str, list[str]] = {name: [] for name in LIMITS}
    defined: dict[str, list[str]] = defaultdict(list)
    for path, tree, text in sources():
        places["old words in the source"] += _old_words(path, text)
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                line = getattr(node, "lineno", 1)
                if FRAGMENT.match(ast.get_docstring(node) or ""):
                    places["docstrings that are fragments"].append(f"{path}:{line}")
        for node in tree.body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
                defined[node.name].append(f"{path}:{node.lineno}")
            for name in _constants(node):
                if "_" not in name.strip("_"):
                    places["module constants of one word"].append(f"{path}:{node.lineno} {name}")
    twice = {name: where for name, where in sorted(defined.items()) if len(where) > 1}
    for name, where in twice.items():
        line = f"{name}: {', '.join(where)}"
        places["public names defined twice"].append(line)
        if name not in DEFINED_TWICE:
            places["public names defined twice without a reason"].append(line)
    places["reasons for names that are not defined twice"] += DEFINED_TWICE.keys() - twice.keys()
    for path, text in documents():
        places["old words in the documents"] += _old_words(path, text)
        places["table cells above 25 words"] += [
            f"{path}:{number}"
            for number, line in enumerate(text.splitlines(), 1)
            if line.startswith("|")
            for cell in line.split("|")
            if len(cell.split()) > WORDS_IN_A_CELL
        ]
    return places


def _old_words(path: str, text: str) -> list[str]:
    """Return the places of old words in a text."""
    return [
        f"{path}:{number} {match[0]}"
        for number, line in enumerate(text.splitlines(), 1)
        for match in OLD_WORDS.finditer(line)
    ]


def _constants(node: ast.stmt) -> list[str]:
    """Return the upper-case names that a statement defines."""
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [
        name.id
        for target in targets
        if target is not None
        for name in ast.walk(target)
        if isinstance(name, ast.Name) and name.id.isupper()
    ]


def main() -> int:
    """Print the counts, and return 1 if one exceeds its limit."""
    places = found()
    for name, where in places.items():
        verdict = "" if len(where) <= LIMITS[name] else "  too many"
        print(f"{len(where):5d} of {LIMITS[name]:5d}  {name}{verdict}")
        if "-v" in sys.argv[1:]:
            print(*(f"        {place}" for place in where), sep="\n")
    return int(any(len(where) > LIMITS[name] for name, where in places.items()))


if __name__ == "__main__":
    sys.exit(main())
