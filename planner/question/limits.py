"""Limits of a question: caps on a plan, ranges of an advice, and names of extras.

They are msgspec structs without numpy arrays, so that they can be sent as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Final, Literal, get_args

from msgspec import Meta
from msgspec.structs import force_setattr, replace

from hand_models.base import Force, InvalidFieldError, Name, Strict, Tension, check_positive

__all__ = [
    "BodyRange",
    "ForceCap",
    "LimbStiffness",
    "Limits",
    "Margins",
    "Want",
    "no_torque",
]

Want = Literal[
    "load_factor", "prices", "model", "robust", "open_loop", "spread", "clearance", "advice"
]

Frame = Literal["hand", "body", "world"]

Margins = Literal["required", "if_possible"]

LEAST_LIMIT: Final = 1e-3
"""Least force or torque that is valid as a limit [N, N·m]; a smaller one is a rounding error."""

MOST_MARGIN: Final = 1e3
"""Largest margin or least tension that may be given [N]."""

Torque = Annotated[float, Meta(ge=1e-3, le=1e6)]
JointTorque = Annotated[float, Meta(ge=0.0, le=1e6)]
Torques = Annotated[
    Sequence[JointTorque],
    Meta(
        min_length=1,
        max_length=64,
        description="of a limb's joints from the body outward, 0 of one without a motor [N·m]",
    ),
]
ForceBound = Annotated[float, Meta(ge=-1e6, le=1e6)]
ForceRange = Annotated[
    Sequence[ForceBound],
    Meta(min_length=2, max_length=2, description="least and largest, with zero in between [N]"),
]
# a tuple with lists in it crashes msgspec's garbage collection
AxisForces = Annotated[Sequence[Force | ForceRange | None], Meta(min_length=3, max_length=3)]
Utilisation = Annotated[float, Meta(ge=1e-3, le=1.0)]


class ForceCap(Strict, frozen=True):
    """Cap on the force that a hand exerts on its rock.

    Attributes
    ----------
    largest_force : float, or sequence of (float, pair of float or None), length 3
        One number: largest force in any direction [N]. Three entries, one for each axis of
        ``frame``: the largest force either way, or a pair of the least (≤ 0) and the largest (≥ 0)
        force, which may be infinite, or None for no cap [N].
    frame : {'hand', 'body', 'world'}
        Frame of the axes: the hand frame H, the body frame B or the world frame W.
    """

    largest_force: Annotated[
        Force | AxisForces,
        Meta(
            description="whatever its direction; or along each axis of the frame: the largest "
            "either way, a range, or null for none"
        ),
    ]
    frame: Frame = "hand"

    def __post_init__(self) -> None:
        frames = get_args(Frame)  # in which a force may be capped
        if self.frame not in frames:
            raise InvalidFieldError(
                f"unknown frame {self.frame!r}; known are {', '.join(frames)}", field="frame"
            )
        most = self.most
        if isinstance(most, float):
            if not (math.isfinite(most) and most >= LEAST_LIMIT):
                raise InvalidFieldError(
                    f"must be finite and at least {LEAST_LIMIT:g} N, got {most:g}",
                    field="largest_force",
                )
            return
        if len(most) != 3:
            raise InvalidFieldError(
                f"one number, or an entry for each of 3 axes, is needed, got {len(most)} entries",
                field="largest_force",
            )
        for i, (low, high) in enumerate(most):
            if not low <= 0.0 <= high or low == high:
                raise InvalidFieldError(
                    "must go from 0 N or less to 0 N or more, not both 0, got "
                    f"{low:g} to {high:g} N",
                    field=f"largest_force[{i}]",
                )
            if any(0.0 < abs(end) < LEAST_LIMIT for end in (low, high)):
                raise InvalidFieldError(
                    f"each end must be 0 or at least {LEAST_LIMIT:g} N, got {low:g} to {high:g} N",
                    field=f"largest_force[{i}]",
                )

    @property
    def most(self) -> float | tuple[tuple[float, float], ...]:
        """Largest force in any direction, or the least and largest force along each axis [N]."""
        given = self.largest_force
        return tuple(map(_range, given)) if isinstance(given, Sequence) else float(given)

    def use(self, force: Sequence[float], beside: Sequence[float] = (0.0, 0.0, 0.0)) -> float:
        """Return the largest share of the cap that a force has; infinite along an axis of none.

        Parameters
        ----------
        force : sequence of float, length 3
            Force on the rock, in the frame of the cap [N].
        beside : sequence of float, length 3, optional
            How far the force may be from there along each axis [N].
        """
        most = self.most
        if isinstance(most, float):
            return math.hypot(*(abs(f) + d for f, d in zip(force, beside, strict=True))) / most
        shares = [0.0]
        for f, d, (low, high) in zip(force, beside, most, strict=True):
            for along, end in ((f + d, high), (d - f, -low)):
                # forces of less than 1e-6 N count as none
                shares.append(along / end if end else math.inf if along > 1e-6 else 0.0)
        return max(shares)


def _range(axis: float | Sequence[float] | None) -> tuple[float, float]:
    """Return the least and the largest force along an axis [N]."""
    if axis is None:
        return -math.inf, math.inf
    if isinstance(axis, Sequence):
        low, high = axis
        return float(low), float(high)
    return -axis, axis


class Limits(Strict, frozen=True):
    """Limits that the caller puts on a plan.

    Attributes
    ----------
    utilisation : float
        Cap on the utilisation: the largest that still counts as ``optimal``, in (0, 1].
    tendon_tension : float, optional
        Largest tension of every tendon [N]; the hand's maximum counts if it is less.
    joint_torque : float or mapping of str to (float or sequence of float), optional
        Torque limit of every joint, or by limb, in place of the robot's limits [N·m]; of a
        prismatic joint a force [N]. Zero, valid in a list only, for a joint without a motor.
    per_hand : mapping of str to ForceCap
        Cap on each hand's force, by limb.
    tension_change : float, optional
        Largest change of a tendon's tension from the present one [N].
    margins : {'required', 'if_possible'}
        Whether a plan must keep the three margins that follow, or the largest common share of them
        that costs at most a tenth of the least utilisation, and no more than the cap leaves.
    hold_margin : float, optional
        Force by which every tile on rock must stay short of being dragged backward, and every bare
        frame must press on the rock [N]. By default zero, or that of ``plans.toml`` where margins
        are kept if possible.
    palm_margin : float
        Force with which every palm of a hand with a fixed wrist must press on the rock, if it is
        engaged [N].
    least_tension : float
        Least tension of every tendon [N]. It rules out fingers with slack tendons that grip only by
        the wrist's travel.
    """

    utilisation: Utilisation = 1.0
    tendon_tension: Tension | None = None
    joint_torque: Annotated[
        Torque | Mapping[Name, Torque | Torques] | None,
        Meta(description="of all joints, or by limb, in place of the robot's own figures [N·m]"),
    ] = None
    per_hand: Annotated[Mapping[Name, ForceCap], Meta(description="by limb")] = {}
    tension_change: Annotated[
        Tension | None, Meta(description="largest change from the present tensions [N]")
    ] = None
    margins: Annotated[
        Margins, Meta(description="whether the margins must be kept, or what can be of them")
    ] = "required"
    hold_margin: Annotated[
        Annotated[float, Meta(ge=0.0, le=MOST_MARGIN)] | None,
        Meta(description="by which tiles are short of being dragged backwards [N]"),
    ] = None
    palm_margin: Annotated[
        float,
        Meta(ge=0.0, le=MOST_MARGIN, description="with which palms of fixed wrists press [N]"),
    ] = 0.0
    least_tension: Annotated[
        float, Meta(ge=0.0, le=MOST_MARGIN, description="of every tendon [N]")
    ] = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.utilisation <= 1.0:
            raise InvalidFieldError(
                f"must be above 0 and at most 1, got {self.utilisation:g}", field="utilisation"
            )
        for name in ("tendon_tension", "tension_change"):
            most = getattr(self, name)
            if most is not None:
                check_positive(most, "N", name)
        if self.margins not in get_args(Margins):
            raise InvalidFieldError(
                f"must be one of {', '.join(get_args(Margins))}, got {self.margins!r}",
                field="margins",
            )
        for name in ("hold_margin", "palm_margin", "least_tension"):
            least = getattr(self, name)
            if least is not None and not 0.0 <= least <= MOST_MARGIN:
                raise InvalidFieldError(
                    f"must be 0 to {MOST_MARGIN:g} N, got {least:g}", field=name
                )
        cap = self.tendon_tension
        if cap is not None and self.least_tension > cap:
            raise InvalidFieldError(
                f"must be at most tendon_tension ({cap:g} N), got {self.least_tension:g} N; lower "
                "it, or raise tendon_tension",
                field="least_tension",
            )
        torque = self.joint_torque
        if torque is None:
            return
        if isinstance(torque, Mapping):
            torque = {
                limb: tuple(most) if isinstance(most, Sequence) else most
                for limb, most in torque.items()
            }
            force_setattr(self, "joint_torque", torque)
        by_limb = torque if isinstance(torque, Mapping) else {"": torque}
        for limb, given in by_limb.items():
            each = given if isinstance(given, tuple) else (given,)
            idle = 0.0 if isinstance(given, tuple) else LEAST_LIMIT
            if not all(most == idle or LEAST_LIMIT <= most < math.inf for most in each):
                raise no_torque(each, "joint_torque" + (f".{limb}" if limb else ""))

    @property
    def asked_margins(self) -> Mapping[str, float]:
        """Margins by name, with the default of ``hold_margin`` [N]; only those above zero."""
        hold = self.hold_margin
        if hold is None and self.margins == "if_possible":
            from hand_models.parameters import bundled_table  # NumPy, which messages do not need

            hold = bundled_table("plans.toml", "planner.parameters").positive(
                "margins", "hold_margin"
            )
        each = {
            "hold_margin": hold or 0.0,
            "palm_margin": self.palm_margin,
            "least_tension": self.least_tension,
        }
        return {name: least for name, least in each.items() if least}

    def with_share(self, share: float) -> Limits:
        """Return the limits with a share of each margin, from 0 (without) to 1."""
        none = {"hold_margin": 0.0, "palm_margin": 0.0, "least_tension": 0.0}
        own = {name: share * least for name, least in self.asked_margins.items()}
        return replace(self, **{**none, **own})


def no_torque(given: Sequence[float], field: str) -> InvalidFieldError:
    """Return the error for invalid joint torque limits.

    Parameters
    ----------
    given : sequence of float
        The values, of which at least one is invalid.
    field : str
        Their field in the question.
    """
    return InvalidFieldError(
        f"must be finite and at least {LEAST_LIMIT:g} N·m, or in a list 0 for a joint without a "
        f"motor (not for all joints of a limb), got {', '.join(f'{most:g}' for most in given)}; "
        "leave it out to keep the robot's own limits",
        field=field,
    )


class LimbStiffness(Strict, frozen=True, kw_only=True):
    """Stiffness with which limbs keep their wrists at pose targets.

    Attributes
    ----------
    position : float
        Along each axis of the hand frame H [N/m].
    angle : float
        About each axis of the hand frame H [N·m/rad].
    """

    position: Annotated[float, Meta(ge=100.0, le=1e9, description="along each axis of H [N/m]")]
    angle: Annotated[float, Meta(ge=1.0, le=1e9, description="about each axis of H [N·m/rad]")]

    def __post_init__(self) -> None:
        # softer, a wrist would aim metres away: the unit is wrong
        for name, value, least, unit in (
            ("position", self.position, 100.0, "N/m"),
            ("angle", self.angle, 1.0, "N·m/rad"),
        ):
            if not least <= value <= 1e9:
                raise InvalidFieldError(
                    f"must be {least:g} to 1e9 {unit}, got {value:g}", field=name
                )

    @property
    def each(self) -> tuple[float, ...]:
        """Stiffness of each component of a wrist's twist, length 6 [N/m, N·m/rad]."""
        return (self.position,) * 3 + (self.angle,) * 3


class BodyRange(Strict, frozen=True):
    """Range in which an advice may move the body from its present pose.

    Attributes
    ----------
    shift : float
        Largest shift along each axis of the body frame B, either way [m].
    tilt : float
        Largest rotation about one axis of B through the centre of mass, either way [rad].
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
                raise InvalidFieldError(
                    f"must be finite and at least 0 {unit}, got {most:g}", field=name
                )
