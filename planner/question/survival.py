"""Settings of survival: how strengths scatter, how many are drawn, and how late set-points are."""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta, structs

from hand_models.base import InvalidFieldError, Strict

__all__ = ["SurvivalSettings"]

USUAL_REPLANNED: Final = 100
"""Draws with new set-points: with 0.26 s for each on two busy cores, 100 take half a minute."""

Scatter = Annotated[float, Meta(ge=0.0, le=2.0)]


class SurvivalSettings(Strict, frozen=True, kw_only=True):
    """Draws of strengths for which a plan's tiles may slip.

    Attributes
    ----------
    draws : int
        Number of draws at fixed tensions.
    replanned : int
        Number of draws with new set-points after each slip, the first of the same draws; 0 leaves
        them out. The default, 100, stands for all draws if there are fewer.
    seed : int
        Seed of the draws.
    strength : float
        c, true mean strength of all tiles over the assumed one.
    hold_scatter, rock_scatter : float, optional
        Standard deviation of the logarithm of the factor that all tiles of a hand share, and of
        that of all hands; those of ``strength.toml`` by default.
    delay : float
        Time from a slip to the new set-points [s].
    """

    draws: Annotated[int, Meta(ge=1, le=1_000_000, description="at fixed tensions")] = 2000
    replanned: Annotated[
        int, Meta(ge=0, le=100_000, description="with new set-points after each slip")
    ] = USUAL_REPLANNED
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1, description="of the draws")] = 0
    strength: Annotated[
        float, Meta(ge=0.01, le=100.0, description="true mean strength over the assumed one")
    ] = 1.0
    hold_scatter: Annotated[
        Scatter | None, Meta(description="of the logarithm of a factor of each hold")
    ] = None
    rock_scatter: Annotated[
        Scatter | None, Meta(description="of the logarithm of a factor of all the rock")
    ] = None
    delay: Annotated[
        float, Meta(ge=0.0, le=10.0, description="from a slip to the new set-points [s]")
    ] = 0.0

    def __post_init__(self) -> None:
        for name, least, most, unit in (
            ("draws", 1, 1_000_000, ""),
            ("replanned", 0, 100_000, ""),
            ("seed", 0, 2**32 - 1, ""),
            ("strength", 0.01, 100.0, ""),
            ("hold_scatter", 0.0, 2.0, ""),
            ("rock_scatter", 0.0, 2.0, ""),
            ("delay", 0.0, 10.0, " s"),
        ):
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise InvalidFieldError(
                    f"must be {least:g} to {most:.10g}{unit}, got {value:g}", field=name
                )
        if self.draws < self.replanned == USUAL_REPLANNED:
            structs.force_setattr(self, "replanned", self.draws)
        if self.replanned > self.draws:
            raise InvalidFieldError(
                f"must be at most draws, {self.draws}, got {self.replanned}", field="replanned"
            )
