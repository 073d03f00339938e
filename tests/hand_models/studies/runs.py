"""Studies that the tests share, run coarsely where they would take minutes."""

import json
import tempfile
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

from hand_models import experiments
from hand_models.experiments.pulling import PULLING_SETTINGS
from hand_models.studies import as_json, load_study, run_study
from hand_models.studies.settings import STUDY_SETTINGS

COARSE = {
    "fig13": {"fig13_pulls": 40, "fig13_piece_directions": 8},
    "fig14": {"fig14_pulls": 40},
    "fig15": {"fig15_tensions": 3, "fig15_rays": 100, "fig15_cuts": 2, "fig15_starts": 1},
    "fig16": {"fig16_points": 3, "fig16_coarse_points": 2},
}
"""Settings of the studies."""

COARSE_SEARCH = replace(PULLING_SETTINGS, poses_per_axis=20)


@cache
def studied(name):
    """Return a study's result, its files and the steps that it told."""
    steps, coarse = [], replace(STUDY_SETTINGS, **COARSE.get(name, {}))
    with (
        patch.object(load_study(name), "STUDY_SETTINGS", coarse)
        if name in COARSE
        else nullcontext(),
        patch("hand_models.experiments.pulling.PULLING_SETTINGS", COARSE_SEARCH),
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
