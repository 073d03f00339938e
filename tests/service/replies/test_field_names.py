"""A field that is renamed on one side of the wire fails the type check."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

api = pytest.importorskip("mypy.api", reason="mypy is not installed")

ROOT = Path(__file__).parents[3]

CHECKED = (
    "planner/explanation/certificate.py",
    "service/answering/answers.py",
    "service/answering/climbs.py",
    "service/answering/hand_spaces.py",
    "service/answering/questions.py",
    "service/answering/slips.py",
    "service/answering/stances.py",
    "service/answering/streams.py",
)
"""The modules in which the planner's values and messages are made and meet."""

RENAMED = {
    "hand_models/opening/hand_path.py": "jammed",
    "planner/climbs/found_climb.py": "refused",
    "planner/diagnosis/slip_diagnosis.py": "suspects",
    "planner/route/knots.py": "joint_torque",
    "planner/result/plan.py": "joint_torque_limit",
    "planner/result/certificate.py": "irreducible_up_to",
    "service/replies/opening.py": "phalanx",
    "service/replies/reply.py": "backed_off",
    "service/requests/questions.py": "currents",
    "service/requests/stance.py": "seat_direction",
}
"""Where a field is declared, and which: of a hand, of the planner, of both, of a reply, of a
request."""


def errors(folder: Path) -> str:
    """What mypy says of the modules in a copy of the source."""
    options = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(folder / "cache")]
    out, err, _ = api.run([*options, *(str(folder / name) for name in CHECKED)])
    assert not err
    return str(out)


@pytest.mark.slow
def test_a_field_renamed_on_one_side_is_found_by_the_type_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in ("hand_models", "planner", "service"):
        sources = shutil.ignore_patterns("__pycache__", "*.json", "*.stl", "*.urdf", "*.obj")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=sources)
    monkeypatch.chdir(tmp_path)
    for name, field in RENAMED.items():
        text = (tmp_path / name).read_text(encoding="utf-8")
        renamed, count = re.subn(rf"^    {field}:", f"    {field}_renamed:", text, flags=re.M)
        assert count == 1
        (tmp_path / name).write_text(renamed, encoding="utf-8")
    found = errors(tmp_path)
    for field in RENAMED.values():
        assert f'"{field}"' in found
    # and of nothing else
    wrong = [line for line in found.splitlines() if ": error: " in line]
    assert all(any(field in line for field in RENAMED.values()) for line in wrong), found
