"""Questions about a stance: its load, limits and objective, and the extras of the answer."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from typing import ClassVar, Final, Protocol, get_args

from hand_models.base import (
    Array,
    InvalidInputError,
    UnsupportedError,
    check_positive,
    errors_under,
    finite_vector,
)
from hand_models.hand import FINGERS
from hand_models.parameters import ParameterSample, bundled_table
from planner.question.draws import drawn_hands
from planner.question.limits import BodyRange, Limits, Want, no_torque
from planner.question.load import Load, Weights
from planner.question.objectives import (
    MOVING_WRIST_OBJECTIVES,
    Objective,
    ObjectiveNeeds,
    objective_needs,
)
from planner.question.open_loop import OpenLoopSettings
from planner.question.stance import Stance, checked_body_wrench, known_choice, known_limbs

__all__ = ["MOST_DRAWS", "OwnObjective", "Question"]


class OwnObjective(Protocol):
    """Objective that the caller defines: an object like a `planner.solving.Objective`."""

    name: ClassVar[str]


MOST_DRAWS: Final = 100
"""Largest number of samples that a caller may give: each costs a plan and a load factor."""


@dataclass(frozen=True, eq=False)
class Question:
    """A stance with a load, limits and an objective: the input of the planner.

    Attributes
    ----------
    stance : Stance
        Poses of body and hands, and the holds.
    body_wrench : ndarray, shape (6,), optional
        Wrench that the rock must exert on the robot, in the body frame B [N, N·m]; by default
        computed from ``load``.
    load : Load
        Mass, payloads and acceleration. Acceleration and payloads count in the joint torques even
        if the body wrench is given.
    limits : Limits
        Caps on the plan.
    want : frozenset of str
        Extras: 'load_factor', 'prices', 'model', 'robust', 'open_loop', 'spread', 'clearance' and
        'advice'.
    objective : str or planner.solving.Objective
        'max_margin': least utilisation. 'min_effort': least sum of squared relative tensions and
        joint torques, at a utilisation within the limits. 'max_reliability': largest probability
        that no tile slips, at nearly the least utilisation; only with fixed wrists on all hands.
        'max_robust': least mean utilisation over samples of the parameters, with the same
        tensions, at a utilisation within the limits. Or an object with the caller's objective.
    tolerance : float, optional
        Part of the least utilisation by which a plan of 'max_reliability' may exceed it, from
        0.001 to 1; that of ``plans.toml`` by default.
    present : mapping of str to ndarray, shape (4,)
        Present tendon tensions by limb [N]; only of hands with fixed wrists.
    deadline : float, optional
        Time that the answer may take [s]; unbounded by default.
    draws : tuple of ParameterSample, optional
        Samples of the ``spread`` and of 'max_robust'; those of ``draws.toml`` by default.
    explain : bool
        Whether an overloaded or infeasible stance is explained by a certificate. Whether a plan is
        the least, and whether there is none, is checked in any case.
    body_range : BodyRange
        Range in which the ``advice`` may move the body.
    open_loop : OpenLoopSettings, optional
        Samples of ``open_loop``, which requires compliant or floating wrists on all hands and the
        stance's limb stiffness; 64 samples by default.
    """

    stance: Stance
    body_wrench: Array | None = None
    load: Load = field(default_factory=Load)
    limits: Limits = field(default_factory=Limits)
    want: frozenset[Want] = frozenset()
    objective: Objective | OwnObjective = "max_margin"
    present: Mapping[str, Array] = field(default_factory=dict)
    deadline: float | None = None
    draws: tuple[ParameterSample, ...] | None = None
    explain: bool = True
    body_range: BodyRange = field(default_factory=BodyRange)
    open_loop: OpenLoopSettings | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        if self.body_wrench is not None:
            wrench = finite_vector(self.body_wrench, 6, "body_wrench")
            checked_body_wrench(wrench, "body_wrench")
            object.__setattr__(self, "body_wrench", wrench)
        if isinstance(self.objective, str) or not hasattr(self.objective, "name"):
            known_choice(str(self.objective), get_args(Objective), "objective")
        wants = get_args(Want)
        unknown = sorted(set(self.want) - set(wants))
        if isinstance(self.want, str) or unknown:
            raise InvalidInputError(
                f"a set of extras is needed, got {self.want!r}; known are {', '.join(wants)}",
                field="want",
            )
        object.__setattr__(self, "want", frozenset(self.want))
        if self.deadline is not None:
            check_positive(self.deadline, "s", "deadline")
        self._check_limits()
        self._check_fixed_objectives()
        self._check_reliability()
        self._check_draws()
        wrists = {hand.limb: hand.wrist for hand in self.stance.hands}
        floating = [name for name, wrist in wrists.items() if wrist == "floating"]
        if "robust" in self.want and floating:
            raise InvalidInputError(
                "'robust' requires fixed or compliant wrists on all hands; floating are "
                f"{', '.join(floating)}: change these, or remove 'robust'",
                field="want",
            )
        self._check_open_loop()
        present = {}
        for limb, tensions in self.present.items():
            if wrists.get(limb) != "fixed":
                valid = ", ".join(name for name, wrist in wrists.items() if wrist == "fixed")
                raise InvalidInputError(
                    "must be a hand of the stance with a fixed wrist; "
                    + (f"valid are {valid}" if valid else "there is none: remove present"),
                    field=f"present.{limb}",
                )
            present[limb] = finite_vector(tensions, len(FINGERS), f"present.{limb}")
            if present[limb].min() < 0.0:
                raise InvalidInputError(
                    f"must be at least 0 N, got {present[limb].min():g}",
                    field=f"present.{limb}",
                )
        object.__setattr__(self, "present", present)
        if self.limits.tension_change is not None and not present:
            raise InvalidInputError(
                "requires 'present' tensions; give them, or remove tension_change",
                field="limits.tension_change",
            )

    def _check_fixed_objectives(self) -> None:
        moving = [hand.limb for hand in self.stance.hands if hand.wrist != "fixed"]
        if moving and self.needs.fixed_wrists:
            raise UnsupportedError(
                f"{self.objective_name} requires fixed wrists on all hands, as tiles' loads are "
                f"not convex in a wrist's pose; others have {', '.join(moving)}: fix these, or ask "
                f"for {' or '.join(MOVING_WRIST_OBJECTIVES)}",
                field="objective",
            )

    def _check_reliability(self) -> None:
        tolerance = self.tolerance
        if not self.needs.scatter:
            if tolerance is not None:
                raise InvalidInputError(
                    "requires the objective 'max_reliability'; ask for it, or remove tolerance",
                    field="tolerance",
                )
            return
        least_tolerance = 1e-3  # with less, plans hardly differ, and a solver's digits count
        if tolerance is not None and not least_tolerance <= tolerance <= 1.0:
            raise InvalidInputError(
                f"must be {least_tolerance:g} to 1, got {tolerance:g}", field="tolerance"
            )
        # Weibull moduli of 25 and 1.1: larger powers are beyond a solver's digits, and those below
        # 1 are not convex
        least, most = 0.05, 0.9
        for i, hand in enumerate(self.stance.hands):
            whole, scatter = hand.surface.shear_limit, hand.surface.shear_scatter
            if not least * whole <= scatter <= most * whole:
                raise InvalidInputError(
                    f"must be {least:g} to {most:g} times shear_limit ({whole:g} N) for "
                    f"max_reliability, got {scatter:g} N",
                    field=f"stance.hands[{i}].surface.shear_scatter",
                )

    @property
    def objective_name(self) -> str:
        """Name of the objective."""
        return self.objective if isinstance(self.objective, str) else self.objective.name

    @property
    def needs(self) -> ObjectiveNeeds:
        """Needs of the objective."""
        return objective_needs(self.objective_name)

    @property
    def utilisation_tolerance(self) -> float:
        """Part of the least utilisation by which a plan of 'max_reliability' may exceed it."""
        if self.tolerance is not None:
            return self.tolerance
        table = bundled_table("plans.toml", "planner.parameters")
        return table.positive("reliability", "tolerance")

    def _check_draws(self) -> None:
        if "spread" not in self.want and not self.needs.samples:
            if self.draws is not None:
                raise InvalidInputError(
                    "requires 'spread' in want; add 'spread', or remove draws", field="draws"
                )
            return
        if self.draws is not None:
            object.__setattr__(self, "draws", tuple(self.draws))
            if not 1 <= len(self.draws) <= MOST_DRAWS:
                raise InvalidInputError(
                    f"from 1 to {MOST_DRAWS} draws are needed, got {len(self.draws)}", field="draws"
                )
        with errors_under("draws"):
            drawn_hands(self.stance.robot.hand, self.draws)

    def _check_open_loop(self) -> None:
        if "open_loop" not in self.want:
            if self.open_loop is not None:
                raise InvalidInputError(
                    "requires 'open_loop' in want; add it, or remove open_loop", field="open_loop"
                )
            return
        fixed = [hand.limb for hand in self.stance.hands if hand.wrist == "fixed"]
        if fixed:
            raise InvalidInputError(
                "'open_loop' requires wrist 'compliant' or 'floating' of every hand; fixed are "
                f"{', '.join(fixed)}",
                field="want",
            )
        if self.stance.limb_stiffness is None:
            raise InvalidInputError(
                "'open_loop' requires stance.limb_stiffness, with which limbs hold wrists; give "
                "its position [N/m] and angle [N·m/rad]",
                field="want",
            )

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
        self._check_preloads()
        if limits.joint_torque is None:
            return
        if self.stance.joints is None:
            raise InvalidInputError(
                "requires stance.joints, angles or 'solve'; add them, or remove joint_torque",
                field="limits.joint_torque",
            )
        if isinstance(limits.joint_torque, Mapping):
            known_limbs(limits.joint_torque, robot, "limits.joint_torque")
            for limb, most in limits.joint_torque.items():
                count = len(robot.chains[limb].joints)
                if isinstance(most, tuple) and len(most) != count:
                    raise InvalidInputError(
                        f"must have a value for each of {count} joints, got {len(most)}",
                        field=f"limits.joint_torque.{limb}",
                    )
                if isinstance(most, tuple) and not any(most):
                    raise no_torque(most, f"limits.joint_torque.{limb}")

    def _check_preloads(self) -> None:
        """Refuse a least tension above the preload of a floating hand, whose motors stand still."""
        model, least = self.stance.robot.hand, self.limits.least_tension
        for hand in self.stance.hands:
            if hand.wrist != "floating":
                continue
            preload = hand.grasp.closing_tension or model.closing_tension
            if hand.tendon_preload is not None:
                preload = float(hand.tendon_preload.min())
            if least > max(preload, 0.0):  # no preload is below zero
                raise InvalidInputError(
                    "must be at most the preload (tendon_preload, or else the closing tension) of "
                    f"{hand.limb}, {preload:g} N, as motors of floating hands stand still; got "
                    f"{least:g} N; lower it, give more tendon_preload, or let the wrist be "
                    "'compliant'",
                    field="limits.least_tension",
                )

    def bare(self) -> Question:
        """Return the question for the least utilisation, without extras, samples and deadline."""
        least: Objective = "max_margin"
        plain = replace(self, want=frozenset(), draws=None, open_loop=None)
        return replace(plain, deadline=None, objective=least, tolerance=None)

    def turned(self, wrench: Array) -> Question:
        """Return the question for another body wrench, shape (6,) [N, N·m]; the rest is checked.

        Raises
        ------
        InvalidInputError
            If the wrench is not six finite numbers, or too large to be plausible.
        """
        question, given = copy(self), finite_vector(wrench, 6, "body_wrench")
        object.__setattr__(question, "body_wrench", checked_body_wrench(given, "body_wrench"))
        return question

    def needed_wrench(self, weights: Weights | None = None) -> Array:
        """Return the body wrench: what the rock must exert on the robot, in B, shape (6,) [N, N·m].

        It is the question's ``body_wrench`` if given, else computed from its ``load``.

        Parameters
        ----------
        weights : Weights, optional
            Weight of the robot, if its joints are known.

        Raises
        ------
        InvalidInputError
            If the load is not valid; the field is relative to the load.
        """
        if self.body_wrench is not None:
            return self.body_wrench
        return self.load.body_wrench(self.stance, weights)
