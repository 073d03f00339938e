"""Grids of placements on a rock, and of bodies before it; proofs about a wall are about these.

They are msgspec structs, so that they can be sent. What is left out is that of
``parameters/wall_grids.toml``.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from msgspec import Meta, field

from hand_models.base import InvalidFieldError, Strict
from hand_models.hand import Grasp

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable

__all__ = ["BodyGrid", "PlaceGrid"]

Length = Annotated[float, Meta(ge=0.005, le=10.0)]
Distance = Annotated[float, Meta(ge=0.0, le=10.0)]
Count = Annotated[int, Meta(ge=1, le=360)]
Several = Annotated[tuple[float, ...], Meta(min_length=1, max_length=32)]


def _table() -> ParameterTable:
    # a client that only sends requests does without numbers
    from hand_models.parameters import bundled_table

    return bundled_table("wall_grids.toml", "planner.parameters")


def _bundled(section: str, name: str) -> Any:
    """Return a field that is that of the parameter file by default."""

    def value(read: str) -> Any:
        return getattr(_table(), read)(section, name)

    several = name in {"rotations", "stand_offs", "tilts"}
    if name in {"angles", "kept"}:
        return field(default_factory=lambda: round(value("scalar")))
    return field(default_factory=partial(value, "vector" if several else "scalar"))


def _check(grid: Any, ends: dict[str, tuple[float, float]], unit: str) -> None:
    """Check numbers of a grid, or each of several, by name."""
    for name, (low, high) in ends.items():
        value = getattr(grid, name)
        for each in value if isinstance(value, tuple) else (value,):
            if not low <= each <= high:
                raise InvalidFieldError(
                    f"must be {low:g} to {high:g}{unit}, got {each:g}", field=name
                )


def _check_several(grid: Any, *names: str) -> None:
    """Check that there are numbers, all different."""
    for name in names:
        values = getattr(grid, name)
        if not values or len(set(values)) < len(values):
            raise InvalidFieldError(
                f"must be at least one number, and no number twice, got {list(values)}", field=name
            )


class PlaceGrid(Strict, frozen=True):
    """Grid of places where hands are tried on a rock, and which of them are kept.

    Attributes
    ----------
    spacing : float
        Distance of the points of a square grid across z of the rock's frame [m].
    angles : int
        Angles of the wrist at each point, evenly over a whole turn.
    rotations : tuple of float
        Rotations of the outer fingers that are tried [rad].
    kept : int
        Hands that are kept at each point: those with the largest `HandPlace.lift`.
    apart : float
        Least distance of the palms of two hands that are on the rock together [m].
    """

    spacing: Annotated[Length, Meta(description="of a square grid of points [m]")] = _bundled(
        "places", "spacing"
    )
    angles: Annotated[Count, Meta(description="of the wrist at each point")] = _bundled(
        "places", "angles"
    )
    rotations: Annotated[Several, Meta(description="of the outer fingers [rad]")] = _bundled(
        "places", "rotations"
    )
    kept: Annotated[Count, Meta(description="hands at each point, those that lift most")] = (
        _bundled("places", "kept")
    )
    apart: Annotated[Distance, Meta(description="of two palms at least [m]")] = _bundled(
        "places", "apart"
    )

    def __post_init__(self) -> None:
        _check(self, {"spacing": (0.005, 10.0), "apart": (0.0, 10.0)}, " m")
        _check(self, {"angles": (1, 360), "kept": (1, 360)}, "")
        _check_several(self, "rotations")
        for rotation in self.rotations:
            try:
                Grasp(outer_rotation=rotation)
            except InvalidFieldError as error:
                raise InvalidFieldError(error.message, field="rotations") from None


class BodyGrid(Strict, frozen=True):
    """Grid of poses that the body may have before a rock.

    The body faces the mean plane of the whole rock: its z points away from the rock, its x along x
    of the rock's frame. So bodies of one tilt have one orientation.

    Attributes
    ----------
    spacing : float
        Distance of places along the mean plane, up and across [m].
    margin : float
        Distance of places from the ends of the rock [m]; where the rock is smaller, there is one
        place in its middle.
    stand_offs : tuple of float
        Distances of the body's origin from the mean plane of the rock below it [m].
    tilts : tuple of float
        Turns of the body about its y, above zero with its front nearer to the rock [rad].
    footprint : float
        Side of the square whose rock counts as below the body; the plane of the whole rock where
        there is none [m].
    sample : float
        Distance of the points at which the rock is measured for its mean planes [m].
    clear : float
        Distance that the links which no joint moves keep from the rock at least [m].
    turn : float
        Turn up to which a body that is given may be shifted to one of the grid [rad].
    """

    spacing: Annotated[Length, Meta(description="of places up and across the wall [m]")] = _bundled(
        "bodies", "spacing"
    )
    margin: Annotated[Distance, Meta(description="of places from the wall's ends [m]")] = _bundled(
        "bodies", "margin"
    )
    stand_offs: Annotated[
        Several, Meta(description="of the body's origin from the rock's mean plane [m]")
    ] = _bundled("bodies", "stand_offs")
    tilts: Annotated[
        Several,
        Meta(description="about y of B, above zero with its front nearer to rock [rad]"),
    ] = _bundled("bodies", "tilts")
    footprint: Annotated[
        Length, Meta(description="side of the square of rock below the body [m]")
    ] = _bundled("bodies", "footprint")
    sample: Annotated[Length, Meta(description="of points that give mean planes [m]")] = _bundled(
        "bodies", "sample"
    )
    clear: Annotated[Distance, Meta(description="of the body from rock at least [m]")] = _bundled(
        "bodies", "clear"
    )
    turn: Annotated[
        float, Meta(ge=0.0, le=math.pi, description="of a given body to one of the grid [rad]")
    ] = _bundled("bodies", "turn")

    def __post_init__(self) -> None:
        lengths = dict.fromkeys(("spacing", "footprint", "sample"), (0.005, 10.0))
        distances = dict.fromkeys(("margin", "stand_offs", "clear"), (0.0, 10.0))
        _check(self, lengths | distances, " m")
        _check(self, {"tilts": (-1.5, 1.5), "turn": (0.0, math.pi)}, " rad")
        _check_several(self, "stand_offs", "tilts")
