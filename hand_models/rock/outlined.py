"""Holds that a finger's plane cuts in outlines: raw for nails, at a tile's scale for fingers."""

from __future__ import annotations

from abc import abstractmethod

from numpy.typing import ArrayLike

from hand_models.base import Array
from hand_models.parameters import ParameterTable
from hand_models.rock.holds import Hold
from hand_models.rock.smoothing import Scale, raw_outline, smoothed_outline
from hand_models.sections import Section

__all__ = ["OutlinedHold"]


class OutlinedHold(Hold):
    """Rock that is known by raw polylines in each plane.

    Parameters
    ----------
    hand : ParameterTable, optional
        All numbers of the hand that is to grip it, the bundled ones by default: its tiles' length
        is the scale to which the rock is smoothed for its fingers.
    """

    scanned = True

    def __init__(self, hand: ParameterTable | None = None) -> None:
        self._scale = Scale.of(hand)

    @abstractmethod
    def _pieces(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> list[Array]:
        """Return the raw outlines in a plane, rock on their left; arguments as of `section`."""

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        return smoothed_outline(self._pieces(origin, s_axis, t_axis), self._scale)

    def raw_section(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike
    ) -> Section | None:
        return raw_outline(self._pieces(origin, s_axis, t_axis), self._scale)
