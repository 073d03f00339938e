"""Samples of displaced hands for which a question wants its plan executed as it is."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from hand_models.base import InvalidFieldError, Strict

__all__ = ["OpenLoopSettings"]

Shift = Annotated[float, Meta(ge=0.0, le=0.02)]
Rotation = Annotated[float, Meta(ge=0.0, le=0.2)]


class OpenLoopSettings(Strict, frozen=True, kw_only=True):
    """Samples of displaced hands for which a plan is executed as it is.

    A range that is left out is that of the hand's parameters.

    Attributes
    ----------
    samples : int
        Number of samples; in each, every hand has a displacement of its own.
    seed : int
        Seed of the displacements.
    position : float, optional
        Largest displacement along x and along y of the hand frame H, either way [m].
    height : float, optional
        Largest displacement along z of H, either way [m].
    tilt : float, optional
        Largest rotation about x and about y of H, either way [rad].
    yaw : float, optional
        Largest rotation about z of H, either way [rad].
    """

    samples: Annotated[int, Meta(ge=1, le=1000, description="of all hands")] = 64
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1, description="of the displacements")] = 0
    position: Annotated[Shift | None, Meta(description="along x and y of H, either way [m]")] = None
    height: Annotated[Shift | None, Meta(description="along z of H, either way [m]")] = None
    tilt: Annotated[Rotation | None, Meta(description="about x and y of H, either way [rad]")] = (
        None
    )
    yaw: Annotated[Rotation | None, Meta(description="about z of H, either way [rad]")] = None

    def __post_init__(self) -> None:
        # farther, a hand is elsewhere, and the unit is likely wrong
        for name, least, most, unit in (
            ("samples", 1, 1000, ""),
            ("seed", 0, 2**32 - 1, ""),
            ("position", 0.0, 0.02, " m"),
            ("height", 0.0, 0.02, " m"),
            ("tilt", 0.0, 0.2, " rad"),
            ("yaw", 0.0, 0.2, " rad"),
        ):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise InvalidFieldError(
                    f"must be {least:g} to {most:.10g}{unit}, got {value:g}", field=name
                )

    def ranges(
        self, put: tuple[float, float], contact: tuple[float, float]
    ) -> tuple[float, float, float, float]:
        """Return the ranges of position, height [m], tilt and yaw [rad], with defaults of a hand.

        Parameters
        ----------
        put : tuple of float
            Default ranges of position [m] and yaw [rad], from the hand's parameters.
        contact : tuple of float
            Default ranges of height [m] and tilt [rad], likewise.
        """
        given = (self.position, self.height, self.tilt, self.yaw)
        usual = (put[0], *contact, put[1])
        position, height, tilt, yaw = (
            own if value is None else value for value, own in zip(given, usual, strict=True)
        )
        return position, height, tilt, yaw
