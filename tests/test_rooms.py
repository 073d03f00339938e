"""The house: rooms of few modules, indices that load lazily and hide nothing, imports of old."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

from tests.suite.helpers.checkout import ROOT

PACKAGES = ("hand_models", "planner", "service")
ROOMS = sorted(
    path.parent for package in PACKAGES for path in (ROOT / package).glob("*/__init__.pyi")
)
INDICES = [*(ROOT / package for package in PACKAGES), *ROOMS]
MODULES = 14
LINES = 400


def dotted(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def exported(index: Path) -> dict[str, str]:
    """Names that an index exports, and the modules or rooms that it has them from."""
    tree = ast.parse((index / "__init__.pyi").read_text("utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert len(imports) == len(tree.body)
    names = [(alias, node) for node in imports for alias in node.names]
    assert all(alias.asname == alias.name and node.level == 1 for alias, node in names)
    found = {
        alias.name: ".".join(filter(None, (dotted(index), node.module))) for alias, node in names
    }
    assert len(found) == len(names)
    return found


def test_a_room_is_a_dozen_modules_of_one_concept_each():
    for room in ROOMS:
        modules = [path for path in room.glob("*.py") if path.name != "__init__.py"]
        assert 1 <= len(modules) <= MODULES
        for module in modules:
            assert len(module.read_text("utf-8").splitlines()) <= LINES, module


def test_what_an_index_exports_is_what_the_module_defines_and_no_module_hides_it():
    for index in INDICES:
        package = importlib.import_module(dotted(index))
        names = exported(index)
        assert names
        assert sorted(package.__all__) == sorted(names)
        for name, module in names.items():
            assert getattr(package, name) is getattr(importlib.import_module(module), name)
            if module == dotted(index):
                # a room that is exported whole
                continue
            assert not (index / f"{name}.py").exists()
            assert not (index / name / "__init__.py").exists()


def test_nothing_is_found_by_an_objects_identity():
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text("utf-8")
            if not re.search(r"\bid\s*\(|KeyDictionary|ValueDictionary", text):
                continue
            for node in ast.walk(ast.parse(text)):
                asked = isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
                assert not (asked and node.func.id == "id"), f"{path}:{node.lineno}"
                weak = isinstance(node, ast.Name) and node.id.endswith(
                    ("KeyDictionary", "ValueDictionary")
                )
                assert not weak, path


def test_every_room_has_an_index():
    found = {path for package in PACKAGES for path in (ROOT / package).iterdir() if path.is_dir()}
    others = {"__pycache__", "examples", "parameters"}
    assert {path for path in found if path.name not in others} | {
        ROOT / "hand_models" / "parameters"
    } == set(ROOMS)


def test_threads_may_be_the_first_to_import():
    code = """
import sys, threading
sys.setswitchinterval(1e-5)
names = {"planner": ["plan", "Plan", "Load", "hand_space", "WrenchStream", "HandOnHold"],
         "hand_models": ["Pose", "Mesh", "FloatingWrist", "SpinyHand", "WrenchSpace", "Surface"]}
failed = []
def load(package, name):
    try:
        getattr(__import__(package), name, None)
    except BaseException as error:
        failed.append(repr(error))
threads = [threading.Thread(target=load, args=(p, n)) for p in names for n in 2 * names[p]]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(failed)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_imports_of_old_give_the_same():
    for old, room, names in [
        ("hand_models.wrist_inverse", "hand_models.compliance", ("wrist_pose",)),
        ("hand_models.wrist_limit", "hand_models.compliance", ("farthest",)),
        ("service.many", "service", ("Planners", "plan_many")),
        ("service.config", "service.serving", ("zenoh_config",)),
        ("service.errors", "service", ("NoServiceError", "ServiceError", "ServiceTimeout")),
    ]:
        before, now = importlib.import_module(old), importlib.import_module(room)
        for name in names:
            assert getattr(before, name) is getattr(now, name)
