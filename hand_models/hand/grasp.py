"""Settings chosen before a hand closes on a hold: the grasp and the travel of a compliant wrist."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta
from msgspec.structs import force_setattr

from hand_models.base import InvalidFieldError, Strict, Tension, check_positive

__all__ = ["Grasp", "Placing", "WristTravel"]

Placing = Literal["given", "contact"]
"""How a hand comes to its pose: as it is given or seated, or by contact with its rock."""


@dataclass(frozen=True, slots=True)
class RotationTolerances:
    """Tolerances on an outer rotation of π, at which the fingers pinch [rad]."""

    pinch: float = 1e-6
    """How close to π it counts as a pinch."""
    rounded: float = 5e-4
    """How far above π it is taken for it: π rounded to three decimals is."""


ROTATION_TOLERANCES = RotationTolerances()

OuterRotation = Annotated[
    float,
    Meta(
        ge=0.0,
        le=math.pi + ROTATION_TOLERANCES.rounded,
        description="[rad]; what rounding puts above π is π",
    ),
]


class Grasp(Strict, frozen=True):
    """Settings of a hand chosen before it closes on its hold.

    Attributes
    ----------
    outer_rotation : float
        Rotation of the outer fingers, in [0, π] [rad]; up to 5e-4 above π counts as π.
    closing_tension : float, optional
        Tension of each tendon at the moment the tiles catch the rock [N]; by default that of the
        parameter file.
    palm : bool
        Whether the palm may carry load.
    lateral : bool
        Whether engaged spines may carry lateral load.
    fingernail : bool
        Whether the fingers stay straight and cling with their nails alone.
    """

    outer_rotation: OuterRotation = 0.0
    closing_tension: Tension | None = None
    palm: bool = True
    lateral: bool = True
    fingernail: Annotated[
        bool, Meta(description="fingers straight, clinging with their nails alone")
    ] = False

    def __post_init__(self) -> None:
        if not 0.0 <= self.outer_rotation <= math.pi + ROTATION_TOLERANCES.rounded:
            raise InvalidFieldError(
                f"must be in [0, pi] rad, got {self.outer_rotation:g}", field="outer_rotation"
            )
        if self.outer_rotation > math.pi + ROTATION_TOLERANCES.pinch:
            force_setattr(self, "outer_rotation", math.pi)
        if self.closing_tension is not None:
            check_positive(self.closing_tension, "N", "closing_tension")

    @property
    def pinch(self) -> bool:
        """True if the outer fingers oppose the inner ones: ``outer_rotation`` is π."""
        return self.outer_rotation >= math.pi - ROTATION_TOLERANCES.pinch


Travel = Annotated[float, Meta(ge=0.0, le=0.05)]
Turn = Annotated[float, Meta(ge=0.0, le=0.3)]


class WristTravel(Strict, frozen=True):
    """Range of the displacement and rotation of a compliant wrist, about its pose at rest.

    Attributes
    ----------
    position : float
        Largest displacement along each axis of the hand frame H, in both directions [m].
    inward : float
        Largest displacement toward the rock, +z of H, if less than ``position`` [m]. Contact states
        stay those of the closed hand, and are least valid for motion toward the rock.
    angle : float
        Largest rotation about each axis of H, in both directions [rad].
    """

    position: Annotated[Travel, Meta(description="along each axis of H, either way [m]")] = 0.004
    inward: Annotated[Travel, Meta(description="toward the rock, along +z of H [m]")] = 0.001
    angle: Annotated[Turn, Meta(description="about each axis of H, either way [rad]")] = 0.04

    def __post_init__(self) -> None:
        for name, value in (("position", self.position), ("inward", self.inward)):
            if not 0.0 <= value <= 0.05:  # farther, no twist of a wrist is small
                raise InvalidFieldError(f"must be 0 to 0.05 m, got {value:g}", field=name)
        if not 0.0 <= self.angle <= 0.3:
            raise InvalidFieldError(f"must be 0 to 0.3 rad, got {self.angle:g}", field="angle")

    @property
    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Least and largest value of each component of the wrist's twist, two tuples of 6.

        Displacement along x, y, z of the hand frame H [m], then rotation about them [rad].
        """
        most = (self.position,) * 3 + (self.angle,) * 3
        least = tuple([-end for end in most])
        return least, (*most[:2], min(self.inward, self.position), *most[3:])
