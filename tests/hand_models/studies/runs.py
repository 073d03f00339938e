"""Studies that the tests share, run coarsely where they would take minutes."""

import json
import tempfile
import tomllib
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from unittest.mock import patch

from hand_models import experiments
from hand_models.studies import as_json, load_study, run_study

COARSE = {
    "fig13": {"DIRECTIONS": 40, "PIECE_DIRECTIONS": 8},
    "fig14": {"DIRECTIONS": 40},
    "fig15": {"TENSIONS": 3, "RAYS": 100, "CUTS": 2, "STARTS": 1},
    "fig16": {"POINTS": 3, "COARSE_POINTS": 2},
}
"""Numbers of the studies' modules."""

PER_AXIS = 20
"""Poses along each axis of their searches."""


@cache
def studied(name):
    """Return a study's result, its files and the steps that it told."""
    steps, coarse = [], COARSE.get(name)
    with (
        patch.multiple(load_study(name), **coarse) if coarse else nullcontext(),
        patch("hand_models.experiments.pulling.PER_AXIS", PER_AXIS),
    ):
        folder = Path(tempfile.mkdtemp()) / "new" / "folder"
        result, files = run_study(name, folder, lambda *step: steps.append(step))
    return result, files, steps


def check_written(name, *pictures):
    """Hold a study's files and its progress against its result."""
    result, files, steps = studied(name)
    assert [file.name for file in files] == ["result.json", *(f"{each}.png" for each in pictures)]
    assert set(files[0].parent.iterdir()) == set(files)
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in files[1:])
    written = json.loads(files[0].read_text(encoding="utf-8"))
    assert written == json.loads(json.dumps(as_json(result), allow_nan=False))
    # all that is worded is held against the model
    table = tomllib.loads((Path(experiments.__file__).parent / "studies.toml").read_text("utf-8"))
    told = [claim.claim for claim in result.claims]
    for entry in table[name]["claims"].values():
        assert any(claim.startswith(entry["claim"].partition("{")[0]) for claim in told)
    assert result.data["not_tested"] == table[name]["not_tested"]
    assert steps == sorted(steps)
    assert steps[0][0] == 0
    assert len({total for _, total in steps}) == 1
    assert steps[-1][0] == steps[-1][1]
