"""The notebook of ``examples`` goes from a scan to a page."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE

NOTEBOOK = ROOT / "examples" / "first_climb.ipynb"

pytestmark = pytest.mark.slow


def printed(cell):
    """What a cell's code has written, as one text."""
    return "".join(part["text"] for part in cell.outputs if part.output_type == "stream")


def test_the_notebook_goes_from_a_scan_to_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    command = tmp_path / "bin" / "crux"
    command.parent.mkdir()
    run = "from service.__main__ import main; main()"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{run}" "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{command.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    done = nbclient.NotebookClient(
        notebook,
        timeout=PATIENCE,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    ).execute()
    code = [cell for cell in done.cells if cell.cell_type == "code"]
    assert any("triangles" in printed(cell) for cell in code)
    planned = next(cell for cell in code if "plan(asked)" in cell.source)
    assert printed(planned).startswith("optimal")
    stages = printed(next(cell for cell in code if "evaluate(route)" in cell.source)).splitlines()
    assert [line.split()[0] for line in stages] == [
        "start",
        "lift",
        "place",
        "shift",
        "lift",
        "place",
    ]
    assert all(" optimal " in line for line in stages)
    assert (tmp_path / "climb.html").stat().st_size > 1e6


def test_the_notebook_is_kept_without_outputs():
    for cell in json.loads(NOTEBOOK.read_text("utf-8"))["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
