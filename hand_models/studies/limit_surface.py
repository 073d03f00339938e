"""Limit surface of a tile out of the finger plane, and half-planes inside it: a part of Fig. 10."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array
from hand_models.experiments import StudyText, panels
from hand_models.tile import (
    SpineArray,
    Surface,
    bounds_gap,
    directional_strength,
    inner_half_planes,
)

__all__ = ["draw_surface", "half_plane_gaps", "hull_over_surface"]


def half_plane_gaps(surface: Surface, seed: int) -> list[dict[str, float]]:
    """Return, for numbers of half-planes, how far they are inside and outside the law."""
    # for volumes
    directions = np.abs(np.random.default_rng(seed).normal(size=(100_000, 3)))
    directions *= (1.0, -1.0, 1.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    sideways = np.array([[0.0, 0.0, 1.0]])
    gaps = []
    for count in (1, 2, 4, 8):
        pieces = replace(surface, half_planes=count)
        reach = float(directional_strength(inner_half_planes(pieces), sideways)[0])
        gap = bounds_gap(pieces, directions)._asdict()
        gaps.append({"half_planes": count, "lateral_reach": reach / surface.shear_limit, **gap})
    return gaps


def hull_over_surface(surface: Surface) -> float:
    """Return the ratio of the volume of a limit surface's convex hull to the surface's volume.

    Both volumes are of the part with shear T ≥ 0 and normal load N ≤ 0 (pull-off).

    Parameters
    ----------
    surface : Surface
    """
    angle, azimuth = np.meshgrid(
        np.linspace(0.0, math.pi / 2, 181), np.linspace(-math.pi / 2, math.pi / 2, 181)
    )
    radius = surface.strength(angle, azimuth)
    points = radius[..., None] * _directions(angle, azimuth)
    rows = np.trapezoid(radius**3 * np.cos(angle) / 3.0, angle, axis=1)
    own = float(np.trapezoid(rows, azimuth[:, 0]))
    return float(scipy.spatial.ConvexHull(points.reshape(-1, 3)).volume) / own


def draw_surface() -> Figure:
    """Draw the strength over the azimuth at three loading angles."""
    surface, array = Surface.named("sandpaper-36"), SpineArray.named("sandpaper-36")
    figure, shown = panels(1, 3, (13.0, 4.6))
    azimuth = np.radians(np.linspace(-90.0, 90.0, 181))
    for axes, part in zip(shown, (0.0, 0.5, 1.0), strict=True):
        angle = part * surface.pull_off_angle
        directions = _directions(angle, azimuth)
        drag = float(surface.strength(angle)) / float(array.share(angle))
        one, four = (
            directional_strength(inner_half_planes(replace(surface, half_planes=n)), directions)
            for n in (1, 4)
        )
        own = drag * array.share(angle, azimuth)
        for radius, colour, style, label in (
            (own, COLOUR_OF["blue"], "-", "spine array, to its level"),
            (surface.strength(angle, azimuth), "k", "-", "planner's surface"),
            (one, "k", ":", "half-planes: 1"),
            (four, "k", "--", "half-planes: 4"),
        ):
            shear, _, lateral = radius * directions.T
            axes.plot(shear, lateral, color=colour, linestyle=style, label=label)
        StudyText("fig10").label(axes, "azimuth", angle=math.degrees(angle))
        axes.set_aspect("equal")
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _directions(angle: Array | float, azimuth: Array | float) -> Array:
    """Return unit loads (shear, normal, lateral) at loading angles and azimuths, shape (..., 3)."""
    along, aside = np.cos(angle) * np.cos(azimuth), np.cos(angle) * np.sin(azimuth)
    return np.stack(np.broadcast_arrays(along, -np.sin(angle), aside), axis=-1)
