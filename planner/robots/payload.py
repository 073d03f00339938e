"""Masses that a robot carries on its links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, InvalidInputError, check_positive, finite_vector

__all__ = ["Payload", "held_up"]


@dataclass(frozen=True)
class Payload:
    """A mass that is fixed to a link, beside the robot's own.

    Attributes
    ----------
    mass : float
        [kg]
    link : str, optional
        Name of the link in the robot's URDF. Either this or ``limb`` is given.
    limb : str, optional
        Name of the limb whose hand carries it.
    com : tuple of float
        Its centre of mass [m], in the link's frame, or in H of the limb's hand.

    Raises
    ------
    InvalidInputError
        If neither or both of ``link`` and ``limb`` are given, or a number is none.
    """

    mass: float
    link: str | None = None
    limb: str | None = None
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_positive(self.mass, "kg", "mass")
        finite_vector(self.com, 3, "com")
        if (self.link is None) == (self.limb is None):
            raise InvalidInputError(
                "a payload is on a link or on a limb's hand: give link or limb, and not both",
                field="link",
            )


def held_up(mass: float, place: Array, linear: Array, angular: Array) -> Array:
    """Return the wrench in B that a point mass needs to move with the body, shape (6,) [N, N·m].

    ``f = m (a + α × p)`` at p; the body does not turn yet.

    Parameters
    ----------
    mass : float
        [kg]
    place : ndarray, shape (3,)
        p in B [m].
    linear : ndarray, shape (3,)
        a, the acceleration of B's origin less gravity, in B [m/s²].
    angular : ndarray, shape (3,)
        α in B [rad/s²].
    """
    with np.errstate(over="ignore", invalid="ignore"):
        force = mass * (linear + np.cross(angular, place))
        return np.concatenate([force, np.cross(place, force)])
