"""Drive of a tendon: motor torque, current and winch angle for a tendon tension.

A winch of radius r_w on a gear of ratio N, both of efficiency η together, pulls with the tension f
when its motor gives the torque and draws the current

    τ = f r_w / (N η),    I = τ / k_t + I_0,

while it tightens the tendon (k_t the torque constant, I_0 the no-load current); less is needed to
keep a tension, since friction then helps. Both are affine in f, so their limits are rows of a
hand's wrench space as a tendon's limit is.

The length e of tendon drawn in is that of the joints' pulleys and of the tiles' (two strands each,
c_p = 2), whose travel d follows from the tiles' balance (Eq. 5, preload not known and taken as
zero):

    e = r_n ψ + Σ r_i q_i + c_p Σ d_i,    K_p d = c_p M f − T,

with the fingernail's pulley r_n and angle ψ, the joints' pulleys r_i and angles q_i, the tiles'
springs K_p and shears T, and the friction losses M (Eq. 8).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import ParameterTable

__all__ = ["TendonDrive"]

Values = TypeVar("Values", float, Array)
"""One tendon's number, or an array with a number for each tendon."""


@dataclass(frozen=True)
class TendonDrive:
    """Motor, gear and winch of a tendon; the four drives are alike. SI units.

    Attributes
    ----------
    gear_ratio : float
        N, turns of the motor for one of the winch.
    efficiency : float
        η of gear, winch and bushings together, in (0, 1].
    winch_radius : float
        r_w [m].
    torque_constant : float
        k_t of the motor [N·m/A].
    no_load_current : float
        I_0 of the motor [A].
    maximum_torque : float
        Largest continuous torque of the motor [N·m].
    maximum_current : float
        Largest continuous current of motor and driver, the less of the two [A].
    pulley_ratio : float
        c_p, strands of tendon at each tile's pulley.
    tile_stiffness : float
        K_p, stiffness of each tile's springs [N/m].
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
        """Return the drive with the numbers of a ``hand.toml`` table.

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
                f"must be in [0, {drive.maximum_current:g}) A, below maximum_current and "
                f"driver_current, got {drive.no_load_current:g} A",
                field="motor.no_load_current",
            )
        return drive

    @property
    def limits(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Limits of torque and of current as affine functions of the tendon's tension.

        Returns
        -------
        tuple of tuple
            (torque per newton [m], torque at zero tension [N·m], largest torque [N·m]) and (current
            per newton [A/N], current at zero tension [A], largest current [A]).
        """
        return (
            (self.torque_per_newton, 0.0, self.maximum_torque),
            (self.current_per_newton, self.no_load_current, self.maximum_current),
        )

    @property
    def torque_per_newton(self) -> float:
        """τ / f, motor torque per newton of tension [m]."""
        return self.winch_radius / (self.gear_ratio * self.efficiency)

    @property
    def current_per_newton(self) -> float:
        """(I − I_0) / f, motor current beyond no load per newton of tension [A/N]."""
        return self.torque_per_newton / self.torque_constant

    def torque(self, tension: Values) -> Values:
        """Return the motor's torque τ [N·m] that tightens a tendon to ``tension`` [N]."""
        return tension * self.torque_per_newton

    def current(self, tension: Values) -> Values:
        """Return the motor's current I [A] while it tightens a tendon to ``tension`` [N]."""
        return tension * self.current_per_newton + self.no_load_current

    def driven(self, tensions: Array, wound: tuple[Array, Array, Array, Array, Array]) -> Array:
        """Return motor torques [N·m], motor currents [A] and winch angles [rad], shape (3, F).

        Parameters
        ----------
        tensions : ndarray, shape (F,)
            Tension of each tendon [N].
        wound : tuple of ndarray
            The five arguments of `winch_angle`, each of shape (F,).
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
        """Return the angle by which winches turn from the open finger to a tension [rad].

        The open finger is straight (q = 0), its tiles at rest. The motor turns ``gear_ratio`` times
        as far. A tile's end stop is not published and none is modelled, so a tile off the rock
        slides until its spring balances the tendon.

        Parameters
        ----------
        joints : float or ndarray
            Σ r_i q_i of each finger [m].
        tension : float or ndarray
            f [N].
        shears, losses : float or ndarray
            Shear T [N] and diagonal of M (Eq. 8), each summed over the tendon's tiles, with the
            base tile if there is one.
        nail_drawn : float or ndarray, optional
            r_n ψ of the fingernail [m].
        """
        travel = (self.pulley_ratio * losses * tension - shears) / self.tile_stiffness
        return (nail_drawn + joints + self.pulley_ratio * travel) / self.winch_radius
