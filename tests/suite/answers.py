"""What is kept of an answer, how it is written, and where."""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from math import floor, inf, log10
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_info

from tests.suite.comparison import kind_of, scales
from tests.suite.problems import Problem

__all__ = [
    "fields",
    "libraries",
    "read_answers",
    "recorded_here",
    "rounded",
    "told",
    "write_answers",
]

ANSWERS = Path(__file__).parent / "answers"

LIBRARIES = ANSWERS / "libraries.json"
"""With which versions they were recorded."""

DIGITS = 13
"""Of the numbers that are kept."""

WORDS = {
    *("v", "title", "summary", "not_tested", "message", "reason", "warnings", "sentence"),
    *("claim", "claimed", "got", "time", "took", "solver", "rounds", "residual", "stream", "files"),
    "digest",
}
"""Fields that are left out: sentences, clocks, counts of steps, remainders of rounding and its
digest."""

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


def fields(answer: Any, path: str = "") -> set[str]:
    """Return the paths of all fields of an answer, without the places in lists."""
    if isinstance(answer, list):
        return {field for part in answer for field in fields(part, path)}
    if not isinstance(answer, dict):
        return set()
    below = {f"{path}.{name}".lstrip("."): part for name, part in answer.items()}
    return set(below).union(*(fields(part, field) for field, part in below.items()))


def rounded(problem: Problem, answer: dict[str, Any]) -> dict[str, Any]:
    """Return an answer with the digits that are compared, without fields that are not.

    Numbers are rounded to a tenth of what may differ, or less.
    """
    answer = _compared(problem, answer, ())
    return _rounded(problem, answer, (), scales(answer))


def _compared(problem: Problem, value: Any, path: tuple[str, ...]) -> Any:
    if isinstance(value, list):
        return [_compared(problem, part, path) for part in value]
    if not isinstance(value, dict):
        return value
    names = (name for name in value if problem.allowed((*path, name)) < inf)
    return {name: _compared(problem, value[name], (*path, name)) for name in names}


def _rounded(problem: Problem, value: Any, path: tuple[str, ...], sizes: dict[str, float]) -> Any:
    if isinstance(value, list):
        return [_rounded(problem, part, path, sizes) for part in value]
    if isinstance(value, dict):
        return {n: _rounded(problem, part, (*path, n), sizes) for n, part in value.items()}
    if not isinstance(value, float):
        return value
    size = problem.allowed(path) * sizes[kind_of(path)]
    return round(value, 1 - floor(log10(size))) + 0.0


def read_answers(kind: str) -> dict[str, dict[str, Any]]:
    """Return the recorded answers to problems of a kind, by name."""
    file = ANSWERS / f"{kind}.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


def write_answers(kind: str, answers: dict[str, dict[str, Any]]) -> None:
    """Write the answers to problems of a kind, in the order given, a number a line."""
    text = json.dumps(answers, ensure_ascii=False, indent=0)
    (ANSWERS / f"{kind}.json").write_text(f"{text}\n", encoding="utf-8")
    LIBRARIES.write_text(json.dumps(libraries(), indent=1) + "\n", encoding="utf-8")
