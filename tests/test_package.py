"""The wheel that users install: whole, and able to plan where there is no checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.suite.helpers.checkout import ROOT

PACKAGES = ("hand_models", "planner", "service")


def run(*command: str | Path, cwd: Path) -> str:
    own = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=cwd, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def kept_files() -> set[str]:
    """Files of the packages: modules, stubs, stances, parameters, pages, messages of ROS."""
    return {
        file.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }


@pytest.mark.slow
def test_a_plan_is_made_with_an_installed_wheel_alone(tmp_path: Path) -> None:
    """With the same libraries as here; the packages are those of the wheel."""
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check")
    if subprocess.run([*pip, "--version"], capture_output=True, check=False).returncode:
        pytest.skip("pip is not installed")
    run(*pip, "wheel", "--no-deps", "-w", tmp_path, ROOT, cwd=tmp_path)
    (wheel,) = tmp_path.glob("crux_climb-*.whl")
    inside = set(zipfile.ZipFile(wheel).namelist())
    assert kept_files() <= inside

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
    schema = json.loads(run(python.with_name("crux"), "schema", cwd=tmp_path))
    assert schema["$defs"]
    assert "OPTIMAL" in run(python.with_name("crux"), "demo", "-o", "demo.pdf", cwd=tmp_path)
    assert (tmp_path / "demo.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
@pytest.mark.skipif(
    not (find_spec("build") and find_spec("twine")), reason="the extra `release` is not installed"
)
def test_the_sdist_has_all_and_is_described_as_an_index_wants_it(tmp_path: Path) -> None:
    run(sys.executable, "-m", "build", "-o", tmp_path, ROOT, cwd=tmp_path)
    (sdist,), (wheel,) = tmp_path.glob("*.tar.gz"), tmp_path.glob("*.whl")
    with tarfile.open(sdist) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert kept_files() <= names
    assert {"README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "pyproject.toml"} <= names
    assert {"docs/gallery.md", "examples/first_climb.ipynb", "tests/test_package.py"} <= names
    assert not any(name.startswith((".venv", "build/", "docs/reference/gen")) for name in names)
    # built from the sdist, as twine and an index read both
    assert kept_files() <= set(zipfile.ZipFile(wheel).namelist())
    told = run(sys.executable, "-m", "twine", "check", "--strict", sdist, wheel, cwd=tmp_path)
    assert told.count("PASSED") == 2
