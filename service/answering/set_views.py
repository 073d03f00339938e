"""What a reply says of a hand's wrench space at utilisation 1, and what that may cost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import EmptySetError, InvalidInputError, LimitError
from hand_models.wrench_spaces import WrenchSpace
from planner import deadline
from service import replies
from service.answering.hand_answers import vector, vectors
from service.replies import AXES
from service.requests import SpaceWant

__all__ = ["SetViews", "set_views"]

VIEWS: Final = {"vertices": WrenchSpace.vertices, "half_spaces": WrenchSpace.half_spaces}

REACH: Final = "it was known how far the hand's set reaches"

MOST: Final = 30_000
"""Of vertices and of half-spaces, how many candidates are gone through for one set: less than a
second's work, and some megabytes of reply."""

LESS: Final = 'take fewer half_planes of its surface, or "lateral": false in its grasp'

MOST_ROWS: Final = 600
"""Rows of a hand that is closed anew at the places of its scatter: 16 half-planes have 535."""


class SetViews(NamedTuple):
    """What a reply says of a set at utilisation 1; null where nothing is left.

    ``warnings``: what was left out, and why.
    """

    vertices: list[list[float]] | None
    half_spaces: replies.HalfSpaces | None
    dimension: int | None
    capability: dict[str, replies.AxisCapability] | None
    warnings: list[str]


def set_views(space: WrenchSpace, want: Sequence[SpaceWant] | None) -> SetViews:
    """Return what a reply says of a set.

    Parameters
    ----------
    space : WrenchSpace
    want : sequence of SpaceWant, optional
        Vertices and half-spaces that are not among them are left out. By default both are told
        where `MOST` allows.

    Raises
    ------
    InvalidInputError
        If something is wanted twice.
    LimitError
        If what is wanted would take more than `MOST`.
    SolverError
        If a view could not be computed.
    """
    for i, name in enumerate(want or ()):
        if name in (want or ())[:i]:
            raise InvalidInputError(f"{name} is given twice", field=f"want[{i}]")
    if "robust" in (want or ()) and len(space.rows) > MOST_ROWS:
        raise LimitError(
            f"robust: {len(space.rows)} rows at each place are too many (at most {MOST_ROWS}); "
            f"{LESS}, or leave it out",
            field="want",
        )
    try:
        found, warnings = _listed(space, want)
        return SetViews(
            vertices=None if "vertices" not in found else vectors(space.vertices()),
            half_spaces=None if "half_spaces" not in found else _half_spaces(space),
            dimension=space.dimension if space.listed else None,
            capability=_capability(space),
            warnings=warnings,
        )
    except EmptySetError:
        vertices: list[list[float]] | None = [] if want is None or "vertices" in want else None
        return SetViews(vertices, None, None, None, [])


def _listed(space: WrenchSpace, want: Sequence[SpaceWant] | None) -> tuple[list[str], list[str]]:
    """Return which of vertices and half-spaces are told, and warnings of those left out.

    Those that are told have been computed.
    """
    found, warnings = [], []
    for view, compute in VIEWS.items():
        if want is not None and view not in want:
            continue
        try:
            size = getattr(space.sizes(), view)
            if size > MOST:
                raise LimitError(f"{size} candidates to go through are too many (at most {MOST})")
            compute(space)
            found.append(view)
        except LimitError as error:
            if want is not None:
                raise LimitError(
                    f"{view}: {error.message}; {LESS}, or leave it out", field="want"
                ) from None
            warnings.append(f"{view} left out: {error.message}; {LESS}")
    return found, warnings


def _half_spaces(space: WrenchSpace) -> replies.HalfSpaces:
    deadline.check(REACH)
    faces = space.half_spaces()
    return replies.HalfSpaces(
        vectors(faces.normals),
        vector(faces.offsets),
        replies.HalfSpaceEquations(vectors(faces.equation_normals), vector(faces.equation_offsets)),
    )


def _capability(space: WrenchSpace) -> dict[str, replies.AxisCapability]:
    reaches = {}
    for axis, direction in zip(AXES, np.eye(len(AXES)), strict=True):
        deadline.check(REACH)
        ends = space.capability(direction)
        low, high = (None, None) if ends is None else (-float(ends[0]), float(ends[1]))
        for sign, pure, way in (("+", high, direction), ("-", low, -direction)):
            reaches[f"{sign}{axis}"] = replies.AxisCapability(pure, float(space.support(way)))
    return reaches
