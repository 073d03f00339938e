"""Draw the pictures of the gallery again, or some: ``python docs/draw.py [NAME ...]``.

The command that makes a picture stands below it in ``docs/gallery.md``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from PIL import Image

HERE: Final = Path(__file__).parent

SECTION: Final = re.compile(
    r"^!\[[^]]*\]\(([^)]+\.png)\)\n.*?^```(?:sh|\{code-block\} sh\n:caption: [^\n]*)\n(.*?)^```$",
    re.MULTILINE | re.DOTALL,
)

COLOURS_KEPT: Final = (256, 128, 64, 32)
"""Numbers of colours of which a picture has the first that keeps it small enough."""

LARGEST: Final = 300_000
"""Size of a picture [bytes]."""


def pictures() -> Iterator[tuple[Path, str]]:
    """Yield each picture of the gallery with the commands that write it, under its own name."""
    for part in (HERE / "gallery.md").read_text("utf-8").split("\n## ")[1:]:
        for name, commands in SECTION.findall(part):
            yield HERE / name, commands


def draw(picture: Path, commands: str) -> None:
    """Run commands in a folder of their own, and keep the picture that they write there."""
    main = "from service.__main__ import main; main()"
    with TemporaryDirectory() as folder:
        prelude = f"""set -e
            crux() {{ "{sys.executable}" -c "{main}" "$@" || [ $? = 3 ]; }}
            python3() {{ "{sys.executable}" "$@"; }}
        """
        subprocess.run(["bash", "-c", prelude + commands], cwd=folder, check=True)
        drawn = Image.open(Path(folder) / picture.name).convert("RGB")
        picture.parent.mkdir(exist_ok=True)
        for kept in COLOURS_KEPT:
            shown = drawn.quantize(kept, dither=Image.Dither.NONE)
            shown.save(picture, optimize=True)
            if picture.stat().st_size < LARGEST:
                break
    print(f"{picture.relative_to(HERE)}: {picture.stat().st_size / 1e3:.0f} kB", flush=True)


if __name__ == "__main__":
    for path, text in pictures():
        if path.stem in sys.argv[1:] or not sys.argv[1:]:
            draw(path, text)
