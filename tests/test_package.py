"""The wheel that users install: whole, and able to plan where there is no checkout."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.suite.helpers.checkout import ROOT

PACKAGES = ("hand_models", "planner", "service")


def run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_plan_is_made_with_an_installed_wheel_alone(tmp_path: Path) -> None:
    """With the same libraries as here; the packages are those of the wheel."""
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check")
    if subprocess.run([*pip, "--version"], capture_output=True, check=False).returncode:
        pytest.skip("pip is not installed")
    run(*pip, "wheel", "--no-deps", "-w", tmp_path, ROOT, cwd=tmp_path)
    (wheel,) = tmp_path.glob("crux_climb-*.whl")
    inside = set(zipfile.ZipFile(wheel).namelist())
    files = {
        file.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert files <= inside

    run(sys.executable, "-m", "venv", "--without-pip", "own", cwd=tmp_path)
    python = tmp_path / "own" / "bin" / "python"
    run(*pip, "--python", python, "install", "--no-deps", wheel, cwd=tmp_path)
    here = json.loads(
        run(python, "-c", "import json, site; print(json.dumps(site.getsitepackages()))", cwd=ROOT)
    )[0]
    libraries = [path for path in sys.path if Path(path).name == "site-packages"]
    Path(here, "libraries.pth").write_text("\n".join(libraries), encoding="utf-8")
    found = run(python, "-c", "import planner; print(planner.__file__)", cwd=tmp_path)
    assert found.startswith(here)
    answer = json.loads(run(python.with_name("crux"), "plan", "wall-300", "--json", cwd=tmp_path))
    assert answer["status"] == "optimal"
    assert answer["verified"]
