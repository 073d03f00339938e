"""The paper's experiments, repeated with the model: figures, data, and a test of every claim.

A study is a module of this package with ``run(progress, hand) -> StudyResult`` and
``plot(result) -> dict[str, Figure]``; ``hand`` is the table of all parameters of the bundled hand
or of the caller's. Claims that the model does not confirm stay in the result.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

import msgspec
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from hand_models.base import InvalidInputError, Progress, whole_file, write_picture
from hand_models.experiments import StudyResult
from hand_models.parameters import ParameterTable, hand_table

__all__ = [
    "STUDY_MODULES",
    "Study",
    "as_json",
    "load_study",
    "run_study",
]

STUDY_MODULES: Final[Mapping[str, str]] = {
    **{
        name: f"hand_models.studies.{name}"
        for name in (
            *("fig06", "fig07", "fig10", "fig12"),
            *("fig13", "fig14", "fig15", "fig16", "calibrate"),
        )
    },
    "sweep": "hand_models.experiments.sweep",
}
"""Module of each study by the study's name; modules are loaded when needed."""


class Study(Protocol):
    """Interface of a study's module."""

    def run(self, progress: Progress, hand: ParameterTable) -> StudyResult:
        """Compute the study's data and check its claims, with the parameters of a hand.

        ``progress``: called with (steps done, steps in all); ``hand``: all parameters of the hand.
        """

    def plot(self, result: StudyResult) -> dict[str, Figure]:
        """Draw the study's pictures from its result.

        Returns
        -------
        dict of str to Figure
            Pictures by the names of their files, without ending.
        """


def load_study(name: str) -> Study:
    """Import and return a study by its name, such as ``fig06``.

    Raises
    ------
    InvalidInputError
        If there is no study of that name; the field is ``NAME``.
    """
    if name not in STUDY_MODULES:
        known = ", ".join(STUDY_MODULES)
        raise InvalidInputError(f"unknown study {name!r}; known are {known}", field="NAME")
    return cast("Study", import_module(STUDY_MODULES[name]))


def as_json(result: StudyResult) -> dict[str, Any]:
    """Return the content of ``result.json``: arrays as lists, NaN as null."""
    return {"v": 1, **msgspec.to_builtins(result, enc_hook=_plain)}


def _plain(value: Any) -> Any:
    array = np.asarray(value)
    return np.ma.masked_where(array != array, array).tolist()


def run_study(
    name: str | Study, folder: Path, progress: Progress, hand: ParameterTable | None = None
) -> tuple[StudyResult, list[Path]]:
    """Run a study, and write ``result.json`` and its pictures into a folder.

    Parameters
    ----------
    name : str or Study
        A key of `STUDY_MODULES`, or a caller's study.
    folder : Path
        Made if it does not exist.
    progress : Progress
        Called with (steps done, steps in all).
    hand : ParameterTable, optional
        All parameters of the hand; the bundled ones by default.

    Returns
    -------
    result : StudyResult
        Result of the study, its data as in ``result.json``.
    files : list of Path
        Files written, ``result.json`` first.

    Raises
    ------
    InvalidInputError
        If there is no study of that name, or the hand does not suit the study.
    OSError
        If the folder cannot be made or written to.
    """
    study = load_study(name) if isinstance(name, str) else name
    folder.mkdir(parents=True, exist_ok=True)
    hand = hand or hand_table()
    changed = hand.difference(hand_table()).sections
    result = replace(study.run(progress, hand), hand=msgspec.to_builtins(changed))
    text = json.dumps(as_json(result), indent=2, ensure_ascii=False, allow_nan=False)
    files = [folder / "result.json"]
    with whole_file(files[0]) as part:
        part.write_text(text + "\n", encoding="utf-8")
    for picture, figure in study.plot(result).items():
        files.append(folder / f"{picture}.png")
        write_picture(figure, files[-1], 130, bbox_inches="tight")
    return replace(result, data=json.loads(text)["data"]), files
