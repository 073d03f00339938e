"""Step sizes and tolerances of the increments by which fingers are closed."""

from __future__ import annotations

from dataclasses import dataclass

from hand_models.base import BASE_TOLERANCES
from hand_models.tile import LEAST_SHARE

__all__ = ["CONTACT_CODES", "SETTINGS", "ContactCodes", "FingerSettings"]


@dataclass(frozen=True, slots=True)
class ContactCodes:
    """Integer codes of contact states: of a phalanx's contact, and of its tile's spines."""

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
    """Largest number of increments on a path, and the number above which a path is long. Of
    9,940 fingers on rough walls that come to rest nine took more than 400, and one more than
    900."""
    increments_at_once: int = 400
    """Number of increments, of one finger after the other, after which long work is looked at:
    some 10 ms."""
    most_tension: float = 2.0 / 37.0
    most_lowering: float = 0.5 / 37.0
    """Largest growth of the tension in an increment of closing, and fall in one of opening."""
    least_tension: float = 1e-4
    """Smallest growth of the tension where a contact changes."""
    first_stride: float = 0.06
    most_stride: float = 0.3
    least_stride: float = 1e-4
    """Largest turn of the joints in an increment: at the start, in general, and at least after
    increments that went too far [rad]."""
    derivative_turn: float = 1e-7
    """Turn of a joint for derivatives [rad]."""
    catching_part: float = 0.25
    """Length of the path beyond the closing tension, relative to that tension, on which spines
    across gaps are drawn in."""
    still_turn: float = 1e-10
    """Turn that counts as none: at the end of the path, or past a limit [rad]."""
    damped_turn: float = 1e-7
    """Largest turn in an increment at which a damped finger rests at the end of its path [rad]."""
    path_turn: float = 3e-4
    """Turn at one tension below which joints count as on their path when a gap begins to grow
    [rad]. The gap's spines then hold at the least gap so far, whose error is a tenth of the
    turn's square in metres, 10 nm."""
    balance_turn: float = 1e-3
    """Turn at one tension below which joints count as balanced, so that a pull on spines is no
    error of the increment [rad]."""
    damping: float = 0.1
    least_damping: float = 0.025
    most_damping: float = 1e3
    damping_growth: float = 4.0
    """Damping D at first, the least that is kept, the largest, and the factor by which it grows."""
    slow_damping: float = 10.0
    """Damping above which joints count as slow."""
    patience: int = 100
    """Number of increments in a row with more than a tenth of the largest damping after which a
    finger counts as without rest; fingers that rest took 28 at most on 2,000 rough surfaces. Also
    the number at one tension after which a finger that opens goes on without balance."""
    exact_torque: float = 0.003
    path_torque: float = 0.03
    damped_torque: float = 0.3
    """Largest difference between torques and their linearisation: to lengthen the stride, to
    stay on the path, and as a share of the torque that damping leaves."""
    balanced: float = 1e-3
    """Largest torque that is left where a finger on its path counts as balanced."""
    balance: float = 1e-8
    late_balance: float = 5e-7
    """Torque that damping may leave at the end: in general, and on long paths."""
    air_depth: float = 1.0 / 120.0
    rock_depth: float = 1.0 / 300.0
    """Largest additional depth of a phalanx in rock after an increment: for a finger that was in
    the air, and for one on the rock."""
    lost_gap: float = 1.0 / 240.0
    """Distance from the place of a pull-off beyond which a tile may catch again."""
    near_gap: float = 1.0 / 2400.0
    """Gap below which a phalanx may reach the rock in an increment in which others move as well;
    beyond it contacts close one after the other, so that the least gaps are those of the path."""
    held_gap: float = 1.0 / 4800.0
    gap_error: float = 0.1
    """Growth of a gap before its spines hold, at most, and error of a gap over the square of the
    turn to it [m/rad²]."""
    contact_compliance: float = 1e-11
    """Compliance of contacts, which makes the forces of coincident contacts unique [m/N]."""
    rounding: float = BASE_TOLERANCES.force
    """Rounding of forces [N] and torques [N·m]."""
    sum_rounding: float = BASE_TOLERANCES.rounding
    """Rounding of sums, as a share of their terms."""
    least_share: float = LEAST_SHARE
    """Share of a tile's spines below which none hold."""


CONTACT_CODES = ContactCodes()
SETTINGS = FingerSettings()
