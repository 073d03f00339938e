"""The drive of a tendon: from its tension to its motor's torque and current, and its winch's angle.

A winch of radius r_w on a gear of ratio N, both of efficiency η together, pulls with the tension f
when its motor gives the torque and draws the current

    τ = f r_w / (N η),    I = τ / k_t + I_0,

while it tightens the tendon; to hold a tension needs less, since friction then helps. Both are
affine in f, so their limits are rows of a hand's wrench space as a tendon's own limit is.

The tendon drawn in is that of the joints' pulleys and of the tiles' (two strands each, c_p = 2),
whose travel d follows from the tiles' balance (Eq. 5, preload not known and taken as zero):

    e = r_n ψ + Σ r_i q_i + c_p Σ d_i,    K_p d = c_p M f − T,

with the fingernail's pulley r_n and angle ψ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import ParameterTable

__all__ = ["TendonDrive"]

Values = TypeVar("Values", float, Array)
"""One tendon's number, or an array of several's."""


@dataclass(frozen=True)
class TendonDrive:
    """Motor, gear and winch of a tendon, alike for the four of them. SI units.

    Attributes
    ----------
    gear_ratio : float
        N, turns of the motor for one of the winch.
    efficiency : float
        η of gear, winch and bushings together, in (0, 1].
    winch_radius : float
        r_w [m].
    torque_constant : float
        k_t [N·m/A].
    no_load_current : float
        I_0 [A].
    maximum_torque : float
        What the motor gives continuously [N·m].
    maximum_current : float
        What motor and driver bear continuously, the less of the two [A].
    pulley_ratio : float
        c_p of a tile.
    tile_stiffness : float
        K_p [N/m].
    """

    gear_ratio: float
    efficiency: float
    winch_radius: float
    torque_constant: float
    no_load_current: float
    maximum_torque: float
    maximum_current: float
    pulley_ratio: float
    tile_stiffness: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> TendonDrive:
        """Build the drive from ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or impossible.
        """
        positive = table.positive
        drive = cls(
            gear_ratio=positive("motor", "gear_ratio"),
            efficiency=positive("motor", "efficiency"),
            winch_radius=positive("motor", "winch_radius"),
            torque_constant=positive("motor", "torque_constant"),
            no_load_current=table.scalar("motor", "no_load_current"),
            maximum_torque=positive("motor", "maximum_torque"),
            maximum_current=min(
                positive("motor", "maximum_current"), positive("motor", "driver_current")
            ),
            pulley_ratio=positive("tile", "pulley_ratio"),
            tile_stiffness=positive("tile", "spring_stiffness"),
        )
        if drive.efficiency > 1.0:
            raise InvalidInputError(
                f"must be in (0, 1], got {drive.efficiency:g}", field="motor.efficiency"
            )
        if not 0.0 <= drive.no_load_current < drive.maximum_current:
            raise InvalidInputError(
                f"must be in [0, {drive.maximum_current:g}) A, below the limit of motor and "
                f"driver, got {drive.no_load_current:g}",
                field="motor.no_load_current",
            )
        return drive

    @property
    def limits(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Per newton of tension, at none and at most: of the torque [N·m], of the current [A]."""
        return (
            (self.torque_per_newton, 0.0, self.maximum_torque),
            (self.current_per_newton, self.no_load_current, self.maximum_current),
        )

    @property
    def torque_per_newton(self) -> float:
        """τ / f [m]."""
        return self.winch_radius / (self.gear_ratio * self.efficiency)

    @property
    def current_per_newton(self) -> float:
        """(I − I_0) / f [A/N]."""
        return self.torque_per_newton / self.torque_constant

    def torque(self, tension: Values) -> Values:
        """Return the motor's torque τ that tightens a tendon to a tension [N·m]."""
        return tension * self.torque_per_newton

    def current(self, tension: Values) -> Values:
        """Return the current I that the motor draws then [A]."""
        return tension * self.current_per_newton + self.no_load_current

    def driven(self, tensions: Array, wound: tuple[Array, Array, Array, Array, Array]) -> Array:
        """Return torque [N·m] and current [A] of motors, and angle [rad] of winches, (3, F).

        Parameters
        ----------
        tensions : ndarray, shape (F,)
            That the motors hold [N].
        wound : tuple of ndarray
            What `winch_angle` takes.
        """
        return np.array([self.torque(tensions), self.current(tensions), self.winch_angle(*wound)])

    def winch_angle(
        self,
        joints: Values,
        tension: Values,
        shears: Values,
        losses: Values,
        nail_drawn: Values | float = 0.0,
    ) -> Values:
        """Return how far winches turn from the open finger to a tension [rad].

        The open finger is straight (q = 0), its tiles at rest. The motor turns ``gear_ratio`` times
        as far. A tile's end stop is not published and none is modelled, so a tile that touches
        nothing slides as far as its spring lets it.

        Parameters
        ----------
        joints : float or ndarray
            Σ r_i q_i of each finger [m].
        tension : float or ndarray
            f [N].
        shears, losses : float or ndarray
            T [N] and the diagonal of M (Eq. 8), each summed over the tendon's tiles, the base
            tile's too if there is one.
        nail_drawn : float or ndarray, optional
            r_n ψ of the fingernail [m].
        """
        travel = (self.pulley_ratio * losses * tension - shears) / self.tile_stiffness
        return (nail_drawn + joints + self.pulley_ratio * travel) / self.winch_radius
