"""The fingernail: an ultrashort phalanx at each fingertip, for shallow edges (Section 3.2).

It turns about a pin at the end of the distal phalanx, from straight ahead (ψ = 0) toward the rock,
on the softest spring of the finger, so the tendon moves it first. Where it meets rock on its way
its tip hooks; where it meets none it turns by 180° and is out of the way (*retracted*).

To cling, the finger stays straight (its joints are taken as rigid, ``assumed``: a load on the tip
mostly opens them) and only the nails carry. With w the unit vector along the nail and v the one
across it, in which the tendon turns it, the tip loads the rock with P v − A w: P follows from the
tendon's tension f by the balance about the pin, A goes through the pin and is passive,

    P = (f r_n − K_n ψ − p_n) / l_n,        |force along the rock| ≤ μ_n · (force into the rock).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from hand_models.errors import InvalidInputError
from hand_models.parameters import ParameterTable
from hand_models.sections import Section, Vector2

__all__ = ["Fingernail", "Hook"]


class Hook(NamedTuple):
    """A nail whose tip is on the rock, in the coordinates (x, z) of F.

    Attributes
    ----------
    angle : float
        ψ from straight ahead toward the rock [rad].
    tip : tuple of float
        [m]
    normal : tuple of float
        Unit vector out of the rock.
    """

    angle: float
    tip: Vector2
    normal: Vector2


@dataclass(frozen=True)
class Fingernail:
    """The nail's numbers, alike for the four fingers. SI units.

    Attributes
    ----------
    length : float
        l_n, from the pin to the tip [m].
    pulley_radius : float
        r_n [m].
    stiffness, preload : float
        K_n [N·m/rad], p_n [N·m].
    retraction : float
        How far it turns to be out of the way [rad].
    friction : float
        μ_n of its tip on rock.
    """

    length: float
    pulley_radius: float
    stiffness: float
    preload: float
    retraction: float
    friction: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> Fingernail:
        """Read the nail from ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or impossible.
        """
        numbers = {
            name: table.scalar("nail", name)
            for name in (
                "length",
                "pulley_radius",
                "stiffness",
                "preload",
                "retraction",
                "friction",
            )
        }
        for name, value in numbers.items():
            if value < 0.0 or (name in ("length", "pulley_radius", "retraction") and value == 0.0):
                raise InvalidInputError(f"must be above 0, got {value:g}", field=f"nail.{name}")
        return cls(**numbers)

    @property
    def retracting_tension(self) -> float:
        """Tension at which a nail that meets no rock is retracted [N]."""
        return (self.preload + self.stiffness * self.retraction) / self.pulley_radius

    def hook(self, section: Section | None, pin: Vector2) -> Hook | None:
        """Turn the nail until its tip meets the rock.

        Parameters
        ----------
        section : Section or None
            Rock in the finger's plane, in the coordinates (x, z) of F.
        pin : tuple of float
            (x, z) of the nail's pin, the finger straight along x [m].

        Returns
        -------
        Hook or None
            None if there is no rock on its way, or rock is there from the start.
        """
        if section is None or section.clearance((pin[0] + self.length, pin[1])) <= 0.0:
            return None
        angle = section.touch(pin, self.length, 0.0, 0.0, self.retraction)
        if angle is None:
            return None
        tip = (
            pin[0] + self.length * math.cos(angle),
            pin[1] + self.length * math.sin(angle),
        )
        return Hook(angle, tip, section.normal(tip))

    def turning_force(self, angle: float) -> tuple[float, float]:
        """Return P at an angle as an affine function of tension: at zero [N], per newton."""
        held = self.preload + self.stiffness * angle
        return -held / self.length, self.pulley_radius / self.length
