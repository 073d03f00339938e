"""What is known of numba's cache before numba is imported."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from hand_models.base import has_compiled

MODULE = "compiled_here"


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    path = tmp_path / f"{MODULE}.py"
    path.write_text("")
    os.utime(path, (1000, 1000))
    return path


@pytest.mark.parametrize("place", ["__pycache__", "home/numba/folder", "own/folder"])
def test_a_module_is_compiled_where_numba_has_kept_it_since_it_changed(
    place: str, source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if place.startswith("own"):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(source.parent / "own"))
    assert not has_compiled(MODULE)
    folder = source.parent / place
    folder.mkdir(parents=True)
    (folder / "other.f-1.py311.nbi").write_text("")
    assert not has_compiled(MODULE)
    kept = folder / f"{MODULE}.f-1.py311.nbi"
    kept.write_text("")
    assert has_compiled(MODULE)
    os.utime(kept, (900, 900))
    assert not has_compiled(MODULE)


def test_an_unknown_module_is_not_compiled() -> None:
    assert not has_compiled("compiled_nowhere")
