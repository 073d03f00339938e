"""Step sizes and tolerances of the increments by which fingers are closed."""

from __future__ import annotations

from dataclasses import dataclass

from hand_models.base import BASE_TOLERANCES

__all__ = ["CONTACT_CODES", "SETTINGS"]


@dataclass(frozen=True, slots=True)
class ContactCodes:
    """Integer codes of a contact state: of a phalanx's contact, and of its tile's spines."""

    off: int = 0  # the phalanx is off the rock
    on: int = 1  # it touches the rock
    held: int = 2  # its spines hold it at the least gap
    caught: int = 0  # all spines that reach the rock hold
    pulled: int = 1  # some were pulled off
    lost: int = 2  # some were, and the tile has left the place since


@dataclass(frozen=True, slots=True)
class FingerSettings:
    """Sizes of increments, and tolerances, relative to a finger's own scales.

    Tensions are relative to the closing tension, torques to the proximal joint's torque at the
    closing tension, damping to that torque over one radian, gaps to a tile's length.
    """

    most_increments: int = 1200
    long_path: int = 600
    """Increments on a path, and from which on it is a long one; of 9,940 fingers on rough walls
    that come to rest nine had more than 400, and one more than 900."""
    most_tension: float = 2.0 / 37.0
    """Most of the tension in an increment."""
    least_tension: float = 1e-4
    """Least growth of the tension where a contact changes."""
    first_stride: float = 0.06
    most_stride: float = 0.3
    least_stride: float = 1e-4
    """How far joints turn in an increment: in the air, at most, after it was too far [rad]."""
    derivative_turn: float = 1e-7
    """Turn of a joint for derivatives [rad]."""
    catching_part: float = 0.25
    """Part of the path, after the closing tension, in which spines across gaps are drawn in."""
    still_turn: float = 1e-10
    """Turn that counts as none: at the end of the path, or past a limit [rad]."""
    damped_turn: float = 1e-7
    """Largest turn in an increment at which a damped finger rests at the end of its path [rad]."""
    path_turn: float = 3e-4
    """Turn at one tension up to which joints are on their path where a gap begins to grow: its
    spines hold at the least there was, and that of an increment may be out by a tenth of the turn's
    square in metres, 10 nm [rad]."""
    balance_turn: float = 1e-3
    """Turn at one tension up to which joints are in balance, so that what pulls spines off is no
    error of an increment [rad]."""
    damping: float = 0.1
    least_damping: float = 0.025
    most_damping: float = 1e3
    damping_growth: float = 4.0
    """D at first and at last where it is needed, at most, and by how much it grows."""
    slow_damping: float = 10.0
    """Damping with which joints are slow."""
    patience: int = 100
    """After so many increments in a row with a tenth of the most damping there is no rest; those
    that come to rest had 28 at most on 2,000 rough surfaces."""
    exact_torque: float = 0.003
    path_torque: float = 0.03
    damped_torque: float = 0.3
    """Largest difference of torques from their linearisation: for larger strides, on the path, and
    in parts of what is left by damping."""
    balance: float = 1e-8
    late_balance: float = 5e-7
    """Torque left by damping at the end: as a rule, and where rest takes long."""
    air_depth: float = 1.0 / 120.0
    rock_depth: float = 1.0 / 300.0
    """Most additional depth of a phalanx in rock after an increment: of a finger that comes through
    the air, and of one on the rock, which goes past its path with more."""
    lost_gap: float = 1.0 / 240.0
    """How far a tile goes from where it was pulled off to catch again."""
    near_gap: float = 1.0 / 2400.0
    """Gap up to which a phalanx may come to the rock in an increment in which others move as well:
    one after the other, so that the least gaps are those of the path."""
    held_gap: float = 1.0 / 4800.0
    """Growth of gaps before their spines hold."""
    contact_compliance: float = 1e-11
    """Compliance of contacts, so that those that coincide have forces [m/N]."""
    rounding: float = BASE_TOLERANCES.force
    """Rounding of forces [N] and torques [N·m]."""


CONTACT_CODES = ContactCodes()
SETTINGS = FingerSettings()
