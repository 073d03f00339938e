"""Blocks of the README and of the documents, run as a reader would, page by page.

``sh`` is run by bash, ``python`` in one scope a page, ``json`` and ``toml`` become the file that
their caption names. ``text`` is what the block before it prints, among other lines. What nobody
runs has a caption that says so.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any, Final

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.served import Served, free_endpoint

PAGES: Final = (
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted(page for page in (ROOT / "docs").rglob("*.md") if "generated" not in page.parts),
)

NOT_RUN: Final = "Not run by the tests: "
"""How the caption of a block begins that needs what a test has not."""

ENDPOINT: Final = "127.0.0.1:7447"
"""What pages call the service's; a test has one of its own."""

SET_UP: Final = "python3 -m venv"
"""How the README's two commands begin, which `.ci/run` and its users run."""

FENCE: Final = re.compile(r"^```(\S[^\n]*)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)

OPTIONS: Final = re.compile(r"(?::\w+:[^\n]*\n)*")

CODE: Final = "{code-block} "
"""What is in braces otherwise is no code."""

NUMBER: Final = re.compile(r"(-?\d+(?:\.\d+)?)")

TIME: Final = re.compile(r"[\d.]+ (?:ms|s|µs)\b")

PRELUDE: Final = """set -eo pipefail
crux() { command crux "$@" || { local status=$?; [ $status = 3 ] || return $status; }; }
"""
"""A plan that does not hold is no failure of a page."""


@dataclass(frozen=True)
class Block:
    """One block of a page."""

    language: str
    caption: str
    text: str
    line: int

    @property
    def runs(self) -> bool:
        setting_up = self.text.startswith(SET_UP)
        return self.language in ("sh", "python") and not self.not_run and not setting_up

    @property
    def not_run(self) -> bool:
        return self.caption.startswith(NOT_RUN)


def blocks(page: Path, endpoint: str = ENDPOINT) -> Iterator[Block]:
    """Yield a page's blocks of code, in order."""
    text = page.read_text("utf-8").replace(ENDPOINT, endpoint.rpartition("/")[2])
    for match in FENCE.finditer(text):
        language, content = (match[1] or "").removeprefix(CODE), match[2]
        options = OPTIONS.match(content)[0] if (match[1] or "").startswith(CODE) else ""
        caption = re.search(r"^:caption: (.*)$", options, re.MULTILINE)
        line = text.count("\n", 0, match.start()) + 1
        if not language.startswith("{"):
            code = content.removeprefix(options)
            yield Block(language, caption[1] if caption else "", code, line)


@dataclass
class Reader:
    """Somebody who does what a page says, in a folder of their own."""

    folder: Path
    scope: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    servers: list[Served] = field(default_factory=list)

    def read(self, page: Path) -> None:
        """Run a page; an assertion tells the block that is not as it says."""
        printed = ""
        self._install()
        try:
            for block in blocks(page, free_endpoint()):
                where = f"{page.relative_to(ROOT)}:{block.line}"
                if block.runs:
                    printed = self._run(block, where)
                elif block.language in ("json", "toml"):
                    (self.folder / block.caption).write_text(block.text, "utf-8")
                elif block.language == "text" and not block.caption:
                    missing = not_printed(block.text, printed)
                    assert missing is None, f"{where}: no line is like {missing!r} in\n{printed}"
        finally:
            for server in self.servers:
                server.process.kill()
                server.process.communicate()

    def _install(self) -> None:
        """Put commands beside the folder's files that are those of this checkout."""
        (self.folder / "bin").mkdir()
        main = "from service.__main__ import main; main()"
        for name, line in (
            ("crux", f'"{sys.executable}" -c "{main}" "$@"'),
            ("python3", f'"{sys.executable}" "$@"'),
        ):
            command = self.folder / "bin" / name
            command.write_text(f"#!/bin/sh\nexec {line}\n")
            command.chmod(0o755)

    def _run(self, block: Block, where: str) -> str:
        if block.language == "python":
            with redirect_stdout(StringIO()) as out:
                exec(compile("\n" * block.line + block.text, where, "exec"), self.scope)
            return out.getvalue()
        if block.text.startswith("crux serve "):
            _, _, *flags = block.text.split()
            routed = flags[:2] == ["-m", "client"]
            _, endpoint, *more = flags[2:] if routed else flags
            more += ["--workers", "1"]
            server = Served(endpoint, *more, routed=routed, folder=self.folder)
            self.servers.append(server)
            return ""
        done = subprocess.run(
            ["bash", "-c", PRELUDE + block.text],
            cwd=self.folder,
            env=os.environ
            | {
                "PATH": f"{self.folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
                "PYTHONPATH": str(ROOT),
                "MPLBACKEND": "agg",
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            timeout=PATIENCE,
        )
        assert done.returncode == 0, f"{where}: status {done.returncode}\n{done.stdout}"
        return done.stdout


def not_printed(told: str, printed: str) -> str | None:
    """Return the first line of what a page tells that is not printed, in this order; else None."""
    lines = iter(printed.splitlines())
    for line in told.splitlines():
        if not any(alike(line, other) for other in lines):
            return line
    return None


def alike(one: str, other: str) -> bool:
    """Whether two lines are the same but for spaces, times, and what rounding does to numbers.

    That is 0.1 % of what ``one`` tells, or one of its last digit.
    """
    first, second = (
        NUMBER.split(" ".join(TIME.sub("<time>", line).split())) for line in (one, other)
    )
    if first[::2] != second[::2]:
        return False
    return all(
        abs(float(told) - float(printed)) <= max(1e-3 * abs(float(told)), 1.01 * _last(told))
        for told, printed in zip(first[1::2], second[1::2], strict=True)
    )


def _last(number: str) -> float:
    """Return what one of the last digit of a number is."""
    return float(10.0 ** -len(number.partition(".")[2]))
