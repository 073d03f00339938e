"""What is kept of an answer, how it is written, and where."""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_info

__all__ = ["libraries", "read_answers", "recorded_here", "told", "write_answers"]

ANSWERS = Path(__file__).parent / "answers"

LIBRARIES = ANSWERS / "libraries.json"
"""With which versions they were recorded."""

DIGITS = 13
"""Of the numbers that are kept."""

WORDS = {
    *("v", "title", "summary", "not_tested", "message", "reason", "warnings", "sentence"),
    *("claim", "claimed", "got", "time", "took", "solver", "rounds", "residual", "stream", "files"),
}
"""Fields that are left out: sentences, clocks, counts of steps, remainders of rounding."""

PLACE = {"position", "force", "shear_axis", "normal_axis", "lateral_axis"}
DETAIL = {
    "tiles": PLACE,
    "contacts": PLACE,
    "fingers": {"motor_torque", "motor_current", "winch_angle"},
    "rows": {"finger", "phalanx", "limit", "joint"},
}
"""Fields that only a problem marked ``full`` keeps: of tiles and contacts, of fingers (they follow
from tensions), of a set's rows (their names have them)."""

DIRECTIONS = np.cos(np.arange(1.0, 241.0) ** 2).reshape(40, 6) * [1, 1, 1, 0.1, 0.1, 0.1]
"""Along which large sets of wrenches are measured, moments over 0.1 m."""


def told(answer: dict[str, Any], full: bool = False) -> dict[str, Any]:
    """Return what is kept of an answer.

    Parameters
    ----------
    answer : dict
        As the code gives it.
    full : bool, optional
        Whether places and axes of tiles are kept, and vertices and half-spaces row by row;
        otherwise these sets are measured along `DIRECTIONS`.
    """
    return _kept(answer, full)


def _kept(value: Any, full: bool, name: str = "") -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") + 0.0
    if isinstance(value, list):
        return [_kept(part, full, name) for part in value]
    if not isinstance(value, dict):
        return value
    value = {key: part for key, part in value.items() if key not in WORDS}
    if not value.get("findings", True):
        del value["findings"]  # nothing is odd, as about nearly all that is asked
    if not isinstance(value.get("error", {}), dict):
        del value["error"]  # of a linearisation; not an error reply
    left_out = set() if full else DETAIL.get(name, set())
    value = {key: part for key, part in value.items() if key not in left_out}
    if value.get("half_spaces") is not None:
        value = _measured(value, full)
    return {key: _kept(part, full, key) for key, part in value.items()}


def _measured(reply: dict[str, Any], full: bool) -> dict[str, Any]:
    """Return a wrench space whose facets are rows, or how far it goes where it is not ``full``."""
    faces, vertices = reply["half_spaces"], np.array(reply["vertices"])
    rows = np.column_stack([faces["normals"], faces["offsets"]])
    flat = faces["equations"]
    reply = reply | {"half_spaces": rows.tolist(), "equations": _flat(flat)}
    if full:
        return reply
    along = vertices @ DIRECTIONS.T
    inside = vertices[along.argmax(axis=0)].mean(axis=0)
    speed, room = DIRECTIONS @ rows[:, :6].T, rows[:, 6] - rows[:, :6] @ inside
    ways = np.where(speed > 1e-9, room / np.where(speed > 1e-9, speed, 1.0), np.inf).min(axis=1)
    return reply | {
        "vertices": {"support": along.max(axis=0).tolist()},
        "half_spaces": {"way_out": ways.tolist()},
    }


def _flat(equations: dict[str, Any]) -> dict[str, Any] | None:
    """Return equations in the one form that does not hang on how they are combined."""
    if not equations["normals"]:
        return None
    scale = np.array([1, 1, 1, 10, 10, 10])  # N, and N·m over 0.1 m
    normals = np.array(equations["normals"]) * scale
    back = np.linalg.pinv(normals)
    nearest = back @ np.array(equations["offsets"])
    return {"projector": (back @ normals).tolist(), "nearest": (nearest / scale).tolist()}


KERNELS = {"Zen": "Haswell"}
"""Processors for which the linear algebra does the same as for others."""


def libraries() -> dict[str, str]:
    """Return what decides the last digits: versions installed, kernels, and the processor.

    The same kernels end in other digits on other processors: numpy and libm have ways of their own
    for some.
    """
    versions = {name: version(name) for name in ("clarabel", "cvxpy", "numpy", "scipy")}
    own = [each for each in threadpool_info() if "scipy_openblas" in each.get("prefix", "")]
    kernels = {KERNELS.get(each["architecture"], each["architecture"]) for each in own}
    return {**versions, "kernels": ", ".join(sorted(kernels)), "processor": _processor()}


def _processor() -> str:
    """Return vendor, family and model of the processor, as far as the system says them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    known = dict(line.split(":", 1) for line in lines if ":" in line)
    said = {name.strip(): value.strip() for name, value in known.items()}
    return " ".join(said.get(name, "") for name in ("vendor_id", "cpu family", "model")).strip()


def recorded_here() -> bool:
    """Whether the answers were recorded with the libraries, and kernels, that are used here."""
    return bool(json.loads(LIBRARIES.read_text(encoding="utf-8")) == libraries())


def read_answers(kind: str) -> dict[str, dict[str, Any]]:
    """Return the recorded answers to problems of a kind, by name."""
    file = ANSWERS / f"{kind}.jsonl"
    if not file.exists():
        return {}
    lines = map(json.loads, file.read_text(encoding="utf-8").splitlines())
    return {line["name"]: line["answer"] for line in lines}


def write_answers(kind: str, answers: dict[str, dict[str, Any]]) -> None:
    """Write the answers to problems of a kind, in the order given, one a line."""
    lines = (
        json.dumps({"name": name, "answer": answer}, ensure_ascii=False, separators=(",", ":"))
        for name, answer in answers.items()
    )
    text = "".join(f"{line}\n" for line in lines)
    (ANSWERS / f"{kind}.jsonl").write_text(text, encoding="utf-8")
    LIBRARIES.write_text(json.dumps(libraries(), indent=1) + "\n", encoding="utf-8")
