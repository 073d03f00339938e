"""Limits that a caller puts on a plan and on an advice.

They travel, so that they are here without numbers of numpy's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal, get_args

from msgspec import Meta

from hand_models.base import InvalidFieldError, InvalidInputError, Strict, check_positive

__all__ = ["BodyRange", "ForceCap", "Limits", "no_torque"]

Frame = Literal["hand", "body", "world"]

FRAMES: Final = get_args(Frame)
"""In which frames a force may be capped."""

LEAST: Final = 1e-3
"""Least force or torque that counts as a limit [N, N·m]: a smaller one is nothing but rounding."""


@dataclass(frozen=True)
class ForceCap:
    """The most that a hand may do to its rock.

    Attributes
    ----------
    largest_force : float, or tuple of (float, float) of length 3
        Whatever its direction, or the least and the largest along each axis [N]; those are not
        above and not below zero, and may be infinite.
    frame : {'hand', 'body', 'world'}
        Whose axes they are.
    """

    largest_force: float | tuple[tuple[float, float], ...]
    frame: Frame = "hand"

    def __post_init__(self) -> None:
        if isinstance(self.largest_force, list):
            ranges = tuple((float(low), float(high)) for low, high in self.largest_force)
            object.__setattr__(self, "largest_force", ranges)
        if self.frame not in FRAMES:
            raise InvalidInputError(
                f"unknown frame {self.frame!r}; known are {', '.join(FRAMES)}", field="frame"
            )
        if isinstance(self.largest_force, tuple):
            if len(self.largest_force) != 3:
                raise InvalidInputError(
                    f"3 axes are needed, got {len(self.largest_force)}", field="largest_force"
                )
            for i, (low, high) in enumerate(self.largest_force):
                if not low <= 0.0 <= high or low == high:
                    raise InvalidInputError(
                        f"a range from below to above zero is needed, one end of which may be "
                        f"zero; got {low:g} to {high:g} N",
                        field=f"largest_force[{i}]",
                    )
                if any(0.0 < abs(end) < LEAST for end in (low, high)):
                    raise InvalidInputError(
                        f"an end is zero or at least {LEAST:g} N, got {low:g} to {high:g} N",
                        field=f"largest_force[{i}]",
                    )
        elif not (math.isfinite(self.largest_force) and self.largest_force >= LEAST):
            raise InvalidInputError(
                f"must be at least {LEAST:g} N, got {self.largest_force:g}", field="largest_force"
            )


@dataclass(frozen=True)
class Limits:
    """Caps that a caller puts on a plan.

    Attributes
    ----------
    utilisation : float
        Largest utilisation that still counts as ``optimal``, in (0, 1].
    tendon_tension : float, optional
        Of every tendon [N]; the hand's own maximum if that is less.
    joint_torque : float or mapping of str to (float or sequence of float), optional
        Of every joint, or by limb, in place of the robot's own figures [N·m]; zero of a joint
        without a motor, which bears nothing. Of a joint that slides it is a force [N].
    per_hand : mapping of str to ForceCap
        By limb.
    tension_change : float, optional
        Largest change of a tendon's tension from the present one [N].
    """

    utilisation: float = 1.0
    tendon_tension: float | None = None
    joint_torque: float | Mapping[str, float | Sequence[float]] | None = None
    per_hand: Mapping[str, ForceCap] = field(default_factory=dict)
    tension_change: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.utilisation <= 1.0:
            raise InvalidInputError(
                f"must be in (0, 1], got {self.utilisation:g}", field="utilisation"
            )
        for name in ("tendon_tension", "tension_change"):
            most = getattr(self, name)
            if most is not None:
                check_positive(most, "N", name)
        torque = self.joint_torque
        if torque is None:
            return
        if isinstance(torque, Mapping):
            torque = {
                limb: tuple(most) if isinstance(most, Sequence) else most
                for limb, most in torque.items()
            }
            object.__setattr__(self, "joint_torque", torque)
        by_limb = torque if isinstance(torque, Mapping) else {"": torque}
        for limb, given in by_limb.items():
            each = given if isinstance(given, tuple) else (given,)
            idle = 0.0 if isinstance(given, tuple) else LEAST
            wrong = [most for most in each if not (most == idle or LEAST <= most < math.inf)]
            if wrong:
                raise no_torque(wrong, "joint_torque" + (f".{limb}" if limb else ""))


def no_torque(given: Sequence[float], field: str) -> InvalidInputError:
    """Return the error about the most that joints may bear."""
    return InvalidInputError(
        f"must be at least {LEAST:g} N·m, or in a list 0 for a joint without a motor "
        f"(not all of a limb), got {', '.join(f'{most:g}' for most in given)}",
        field=field,
    )


class BodyRange(Strict, frozen=True):
    """How far an advice may move the body from where it is.

    Attributes
    ----------
    shift : float
        Along each axis of B, either way [m].
    tilt : float
        About one axis of B through the centre of mass, either way [rad].
    """

    shift: Annotated[
        float, Meta(ge=0.0, le=1.0, description="along each axis of B, either way [m]")
    ] = 0.15
    tilt: Annotated[
        float,
        Meta(ge=0.0, le=1.0, description="about an axis of B, through the centre of mass [rad]"),
    ] = 0.2

    def __post_init__(self) -> None:
        for name, unit in (("shift", "m"), ("tilt", "rad")):
            most = getattr(self, name)
            if not (math.isfinite(most) and most >= 0.0):
                raise InvalidFieldError(f"must be 0 {unit} or more, got {most:g}", field=name)
