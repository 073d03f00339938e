"""Answers of a wall's chunks as the bytes of files: arrays by name, no pickles."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from hand_models.base import Pose
from planner.screening import HandParts
from planner.walls.places import HandPlace

__all__ = ["place_arrays", "places_of", "read", "written"]


def written(arrays: dict[str, Any]) -> bytes:
    """Return arrays by name as the bytes of a file."""
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    return out.getvalue()


def read(answer: bytes) -> dict[str, Any]:
    """Return the arrays of a file, by name."""
    with np.load(io.BytesIO(answer), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def place_arrays(places: Sequence[HandPlace], refused: Counter[str]) -> dict[str, Any]:
    """Return placements and reasons of refusals as arrays by name."""
    arrays: dict[str, Any] = {
        "count": np.array(len(places)),
        "reasons": np.array(list(refused), dtype=str),
        "refused": np.array(list(refused.values()), dtype=np.intp),
    }
    for i, place in enumerate(places):
        pose = place.rock_in_hand
        arrays[f"{i}/pose"] = np.column_stack([pose.rotation, pose.position])
        arrays[f"{i}/numbers"] = np.array([place.outer_rotation, place.lift])
        for name, value in place.parts._asdict().items():
            arrays[f"{i}/{name}"] = np.asarray(value)
    return arrays


def places_of(arrays: dict[str, Any]) -> tuple[list[HandPlace], Counter[str]]:
    """Return placements and reasons of refusals from `place_arrays`."""
    counts = zip(arrays["reasons"].tolist(), arrays["refused"].tolist(), strict=True)
    places = list[HandPlace]()
    for i in range(int(arrays["count"])):
        own = {name: arrays[f"{i}/{name}"] for name in HandParts._fields}
        own["lengths"] = tuple(own["lengths"].tolist())
        pose = arrays[f"{i}/pose"]
        at = Pose(np.ascontiguousarray(pose[:, 3]), np.ascontiguousarray(pose[:, :3]))
        rotation, lift = arrays[f"{i}/numbers"].tolist()
        places.append(HandPlace(at, rotation, lift, HandParts(**own)))
    return places, Counter(dict(counts))
