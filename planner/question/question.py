"""What is asked of a stance: what the body needs, what is best, and what must not be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

from hand_models.base import Array, InvalidInputError, check_positive, finite_vector, within
from hand_models.hand import FINGERS
from hand_models.parameters import Draw
from planner.question.draws import drawn_hands
from planner.question.load import Load, Weights
from planner.question.stance import Stance, checked_body_wrench, known_choice, known_limbs

__all__ = ["MOST_DRAWS", "BodyRange", "ForceCap", "Limits", "Objective", "Question", "Want"]

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
        known_choice(self.frame, FRAMES, "frame")
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
                raise _no_torque(wrong, "joint_torque" + (f".{limb}" if limb else ""))


def _no_torque(given: Sequence[float], field: str) -> InvalidInputError:
    """Return the error about the most that joints may bear."""
    return InvalidInputError(
        f"must be at least {LEAST:g} N·m, or in a list 0 for a joint without a motor "
        f"(not all of a limb), got {', '.join(f'{most:g}' for most in given)}",
        field=field,
    )


Objective = Literal["max_margin", "min_effort"]

OBJECTIVES: Final = get_args(Objective)
"""What a plan may be the best in."""

Want = Literal["load_factor", "prices", "model", "robust", "spread", "clearance", "advice"]

WANTS: Final = get_args(Want)
"""What may be wanted beside a plan."""

MOST_DRAWS: Final = 100
"""Of a caller's own: each costs a plan and a load factor."""


@dataclass(frozen=True)
class BodyRange:
    """How far an advice may move the body from where it is.

    Attributes
    ----------
    shift : float
        Along each axis of B, either way [m].
    tilt : float
        About one axis of B through the centre of mass, either way [rad].
    """

    shift: float = 0.15
    tilt: float = 0.2

    def __post_init__(self) -> None:
        for name, unit in (("shift", "m"), ("tilt", "rad")):
            most = getattr(self, name)
            if not (math.isfinite(most) and most >= 0.0):
                raise InvalidInputError(f"must be 0 {unit} or more, got {most:g}", field=name)


@dataclass(frozen=True, eq=False)
class Question:
    """A stance, and what is asked of it.

    Attributes
    ----------
    stance : Stance
    body_wrench : ndarray, shape (6,), optional
        In B [N, N·m]; computed from ``load`` if it is not given.
    load : Load
        Its acceleration and payloads count in the joints' torques whether or not the body wrench is
        given.
    limits : Limits
    want : frozenset of str
        Extras: 'load_factor', 'prices', 'model', 'robust', 'spread', 'clearance', and 'advice',
        which is given by `planner.advice.plan`.
    objective : {'max_margin', 'min_effort'}
        Least utilisation; or least sum of squared relative tensions and joint torques, at a
        utilisation within the limits.
    present : mapping of str to ndarray, shape (4,)
        Tensions of tendons now, by limb [N].
    deadline : float, optional
        How long the answer may take [s]; as long as it takes by default.
    draws : tuple of Draw, optional
        Over which the ``spread`` is told; those of ``draws.toml`` by default.
    explain : bool
        Whether it is proven and told what keeps an overloaded or infeasible stance from a plan.
        That a plan is the least, and that there is none, is always checked.
    body_range : BodyRange
        How far the ``advice`` may move the body.
    """

    stance: Stance
    body_wrench: Array | None = None
    load: Load = field(default_factory=Load)
    limits: Limits = field(default_factory=Limits)
    want: frozenset[Want] = frozenset()
    objective: Objective = "max_margin"
    present: Mapping[str, Array] = field(default_factory=dict)
    deadline: float | None = None
    draws: tuple[Draw, ...] | None = None
    explain: bool = True
    body_range: BodyRange = BodyRange()

    def __post_init__(self) -> None:
        if self.body_wrench is not None:
            wrench = finite_vector(self.body_wrench, 6, "body_wrench")
            checked_body_wrench(wrench, "body_wrench")
            object.__setattr__(self, "body_wrench", wrench)
        known_choice(self.objective, OBJECTIVES, "objective")
        unknown = sorted(set(self.want) - set(WANTS))
        if isinstance(self.want, str) or unknown:
            raise InvalidInputError(
                f"a set of extras is needed, got {self.want!r}; known are {', '.join(WANTS)}",
                field="want",
            )
        object.__setattr__(self, "want", frozenset(self.want))
        if self.deadline is not None:
            check_positive(self.deadline, "s", "deadline")
        self._check_limits()
        self._check_draws()
        wrists = {hand.limb: hand.wrist for hand in self.stance.hands}
        if "robust" in self.want and "floating" in wrists.values():
            raise InvalidInputError("robust is told of hands with fixed wrists only", field="want")
        present = {}
        for limb, tensions in self.present.items():
            if wrists.get(limb) != "fixed":
                valid = ", ".join(name for name, wrist in wrists.items() if wrist == "fixed")
                raise InvalidInputError(
                    f"only hands of the stance with a fixed wrist have set-points; valid: "
                    f"{valid or 'none'}",
                    field=f"present.{limb}",
                )
            present[limb] = finite_vector(tensions, len(FINGERS), f"present.{limb}")
            if present[limb].min() < 0.0:
                raise InvalidInputError(
                    f"tensions cannot be below 0 N, got {present[limb].min():g}",
                    field=f"present.{limb}",
                )
        object.__setattr__(self, "present", present)
        if self.limits.tension_change is not None and not present:
            raise InvalidInputError(
                "a change from nothing; present tensions are needed", field="limits.tension_change"
            )

    def _check_draws(self) -> None:
        if "spread" not in self.want:
            if self.draws is not None:
                raise InvalidInputError("only spread is told over draws; want it", field="draws")
            return
        if self.draws is not None:
            object.__setattr__(self, "draws", tuple(self.draws))
            if not 1 <= len(self.draws) <= MOST_DRAWS:
                raise InvalidInputError(
                    f"from 1 to {MOST_DRAWS} draws are needed, got {len(self.draws)}", field="draws"
                )
        with within("draws"):
            drawn_hands(self.stance.robot.hand, self.draws)

    def _check_limits(self) -> None:
        robot, limits = self.stance.robot, self.limits
        known_limbs(limits.per_hand, robot, "limits.per_hand")
        for limb in limits.per_hand:
            if limb not in (hand.limb for hand in self.stance.hands):
                raise InvalidInputError(
                    "no hand of this stance; it has "
                    + ", ".join(hand.limb for hand in self.stance.hands),
                    field=f"limits.per_hand.{limb}",
                )
        if limits.joint_torque is None:
            return
        if self.stance.joints is None:
            raise InvalidInputError(
                "the stance says nothing of joints; give stance.joints, or 'solve'",
                field="limits.joint_torque",
            )
        if isinstance(limits.joint_torque, Mapping):
            known_limbs(limits.joint_torque, robot, "limits.joint_torque")
            for limb, most in limits.joint_torque.items():
                count = len(robot.chains[limb].joints)
                if isinstance(most, tuple) and len(most) != count:
                    raise InvalidInputError(
                        f"{count} joints need {count} figures, got {len(most)}",
                        field=f"limits.joint_torque.{limb}",
                    )
                if isinstance(most, tuple) and not any(most):
                    raise _no_torque(most, f"limits.joint_torque.{limb}")

    def needed_wrench(self, weights: Weights | None = None) -> Array:
        """Return the body wrench that is planned for, shape (6,) [N, N·m].

        Parameters
        ----------
        weights : Weights, optional
            What the robot weighs, where its joints are known.
        """
        if self.body_wrench is not None:
            return self.body_wrench
        return self.load.body_wrench(self.stance, weights)
