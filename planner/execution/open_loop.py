"""Execute a plan as it is on displaced hands: tensions and pose targets stay as planned.

A sample displaces each hand on its rock; its pose in the body frame B stays, and the rock moves
instead. A hand that was placed by contact comes to rest anew there, and is displaced from that rest
along z and about x and y. The hand closes there, its tensions go to the planned ones, and the limb
pulls its wrist toward the planned pose target, a twist from where the hand has closed.
Displacements are a scrambled Sobol sequence for each hand, by its limb's name, and combined at
random.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final
from zlib import crc32

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.compliance import CompliantWrist, CompliantWrists, FloatingWrist
from hand_models.fixed_wrist import closed_about, scattered_places
from hand_models.hand import SettledHand
from hand_models.wrench_spaces import WrenchSpace
from planner import deadline
from planner.deadline import DeadlineError
from planner.execution.equilibrium import NEWTON_SETTINGS, LimbPull, equilibria
from planner.prepare import PreparedStance, StanceConstraints, wrists_at
from planner.programs import CAP_SLACK
from planner.question import OpenLoopSettings
from planner.result import HandPlan, OpenLoop, OpenLoopSample, recover_floating_hand

__all__ = ["Passes", "execute", "execute_closed", "find_open_loop"]

Passes = Callable[[Sequence[SettledHand], Sequence[HandPlan], OpenLoopSample], bool]
"""Returns whether closed hands, with their loads and wrists in equilibrium, pass the checks."""


@dataclass(frozen=True, slots=True)
class ExecutionSettings:
    """Tolerance of hard rows, and size of the parts in which samples are computed."""

    violation: float = 1e-3
    """Largest violation of a hard row that counts as none [N]: plans keep to them to 1e-6 N, and
    equilibria to 1e-6 N of all loads together."""
    at_once: int = 16  # samples; the deadline is checked between


EXECUTION_SETTINGS: Final = ExecutionSettings()


def find_open_loop(
    prepared: PreparedStance, hands: Sequence[HandPlan], idle: float, passes: Passes
) -> OpenLoop | None:
    """Return the utilisation over displaced hands if a plan is executed as it is.

    Parameters
    ----------
    prepared : PreparedStance
        All wrists compliant or floating, with the stance's limb stiffness.
    hands : sequence of HandPlan
        Hands of the plan, in the order of the stance.
    idle : float
        Largest utilisation of joints of limbs without a hand, the same in every sample.
    passes : callable
        Check of each equilibrium; one that does not pass counts as none.

    Returns
    -------
    OpenLoop or None
        None if the deadline passed before all samples were in equilibrium.
    """
    settings = prepared.question.open_loop or OpenLoopSettings()
    hand = prepared.question.stance.robot.hand
    ranges = settings.ranges(hand.seat_scatter, hand.contact_scatter)
    position, height, tilt, yaw = ranges
    widths = np.array([position, position, height, tilt, tilt, yaw])
    units = np.stack([_places(limb, settings) for limb in prepared.limbs], axis=1)
    try:
        found, refused, reasons = execute(prepared, hands, widths * units, idle, passes)
    except DeadlineError:
        return None
    return OpenLoop.of(found, settings.seed, ranges, refused, reasons)


def _places(limb: str, settings: OpenLoopSettings) -> Array:
    """Return a hand's displacements in the order of the samples, from −1 to 1, shape (s, 6)."""
    own = np.random.default_rng([settings.seed, crc32(limb.encode()), settings.samples])
    places = scattered_places(limb, settings.samples, settings.seed)
    return np.asarray(own.permutation(places))


def execute(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    displacements: Array,
    idle: float = 0.0,
    passes: Passes = lambda *_: True,
) -> tuple[list[OpenLoopSample], Counter[str], dict[str, str]]:
    """Execute a plan as it is on hands with given displacements.

    Parameters
    ----------
    prepared : PreparedStance
        All wrists compliant or floating, with the stance's limb stiffness.
    hands : sequence of HandPlan
        Hands of the plan, in the order of the stance.
    displacements : ndarray, shape (s, n, 6)
        Displacement of each of n hands on its rock in each of s samples: a twist in H [m, rad].
    idle : float, optional
        Largest utilisation of joints of limbs without a hand.
    passes : callable, optional
        Check of each equilibrium, as of `find_open_loop`.

    Returns
    -------
    samples : list of OpenLoopSample, length s
    refused : Counter of str
        Number of samples in which a hand cannot be closed, by limb.
    reasons : dict of str to str
        Why it cannot at the first such displacement, by limb.

    Raises
    ------
    DeadlineError
        If the deadline passes before all samples are in equilibrium.
    """
    hand, refused, reasons = prepared.question.stance.robot.hand, Counter[str](), dict[str, str]()
    closed: list[list[SettledHand | InvalidInputError]] = []
    for i, limb in enumerate(prepared.limbs):
        closed.append([])
        units = (1.0, 1.0)  # displacements are in metres and radians
        for outcomes in closed_about(
            hand, prepared.batch.hands[i], displacements[:, i], units, units
        ):
            closed[i] += outcomes
            deadline.check(NEWTON_SETTINGS.late)
        for each in closed[i]:
            if isinstance(each, InvalidInputError):
                refused[limb] += 1
                reasons.setdefault(limb, each.message)
    samples = [OpenLoopSample(False)] * len(displacements)
    whole: list[tuple[int, list[SettledHand]]] = []
    for k, outcomes in enumerate(zip(*closed, strict=True)):
        there = [each for each in outcomes if isinstance(each, SettledHand)]
        if len(there) == len(outcomes):
            whole.append((k, there))
    found = execute_closed(prepared, hands, [there for _, there in whole], idle, passes)
    for (k, _), sample in zip(whole, found, strict=True):
        samples[k] = sample
    return samples, refused, reasons


def execute_closed(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    closed: Sequence[Sequence[SettledHand]],
    idle: float = 0.0,
    passes: Passes = lambda *_: True,
) -> list[OpenLoopSample]:
    """Execute a plan as it is on hands that have closed otherwise than planned.

    Parameters
    ----------
    prepared, hands, idle, passes
        As of `execute`.
    closed : sequence of sequence of SettledHand, shape (s, n)
        Closed hands of each sample.

    Raises
    ------
    DeadlineError
        If the deadline passes before all samples are in equilibrium.
    """
    samples: list[OpenLoopSample] = []
    for first in range(0, len(closed), EXECUTION_SETTINGS.at_once):
        part = closed[first : first + EXECUTION_SETTINGS.at_once]
        found = _settled_on(prepared, hands, part, idle)
        for there, (sample, loads) in zip(part, found, strict=True):
            passed = sample.found and passes(there, loads, sample)
            samples.append(sample if passed else OpenLoopSample(False))
    return samples


def _settled_on(
    prepared: PreparedStance,
    hands: Sequence[HandPlan],
    closed: Sequence[Sequence[SettledHand]],
    idle: float,
) -> list[tuple[OpenLoopSample, list[HandPlan]]]:
    """Return the outcomes of samples whose hands have closed, and their loads in equilibrium."""
    question, wrists, tensions = prepared.question, [], []
    for there in closed:
        models = wrists_at(question.stance, there, question.limits.tendon_tension)
        wrists.append([model for model in models if model is not None])
    plans = [hand.wrist for hand in hands if hand.wrist is not None]
    for hand, wrist in zip(hands, wrists[0], strict=True):
        tensions.append(hand.tensions if wrist.driven else wrist.hand.preload)
    stiffness = question.stance.limb_stiffness
    targets = [plan.pose_target for plan in plans if plan.pose_target is not None]
    assert stiffness is not None  # as the question is checked
    pull = LimbPull(
        np.array(stiffness.each), np.array(targets), prepared.hands.transports, prepared.wrench
    )
    start = np.array([plan.twist for plan in plans])
    found = equilibria(wrists, np.array(tensions), pull, start)
    held = np.flatnonzero(found.found & (found.least_stiffness > 0.0)).tolist()
    poses = {
        k: [
            np.concatenate([f, x]) if wrist.driven else x
            for wrist, f, x in zip(wrists[k], tensions, found.twists[k], strict=True)
        ]
        for k in held
    }
    _prepare([pair for k in held for pair in zip(wrists[k], poses[k], strict=True)])
    none, cap = OpenLoopSample(False), question.limits.utilisation + CAP_SLACK
    outcomes = [(none, list[HandPlan]())] * len(wrists)
    for k in held:
        spaces = [wrist.linearised(y) for wrist, y in zip(wrists[k], poses[k], strict=True)]
        uses = map(_use, spaces, poses[k], prepared.hands.added)
        used, violations, drags = map(list, zip(*uses, strict=True))
        whole, dragged = max(*used, idle, 0.0), max(drags)
        sample = OpenLoopSample(
            True,
            whole <= cap and max(violations) <= EXECUTION_SETTINGS.violation,
            whole,
            prepared.limbs[int(np.argmax(used))],
            dragged if dragged > EXECUTION_SETTINGS.violation else 0.0,
            found.body[k].tolist(),
        )
        loads = []
        for i, (wrist, y) in enumerate(zip(wrists[k], poses[k], strict=True)):
            limb, space = prepared.limbs[i], prepared.hands.added[i].on(spaces[i])
            pose = replace(plans[i], twist=found.twists[k][i])
            loads.append(recover_floating_hand(limb, closed[k][i], wrist, space, y, pose))
        outcomes[k] = sample, loads
    return outcomes


def _prepare(poses: Sequence[tuple[FloatingWrist, Array]]) -> None:
    """Compute the loads of compliant wrists at their poses in one call."""
    pairs = [(wrist, y) for wrist, y in poses if isinstance(wrist, CompliantWrist)]
    if pairs:
        wrists, there = zip(*pairs, strict=True)
        CompliantWrists(wrists).prepare([y[None] for y in there])


def _use(space: WrenchSpace, y: Array, added: StanceConstraints) -> tuple[float, float, float]:
    """Return a hand's utilisation, its largest violation of fingers' hard rows, and its drag [N].

    Without the margins that the plan was to keep.
    """
    used = float(added.on(space).utilisations(y).max())
    over, rows = space.H @ y - space.h, space.rows[len(space.s) :]
    of_fingers = np.array([row.finger is not None for row in rows])
    backwards = np.array([row.limit == "dragged_backwards" for row in rows])
    return (
        used,
        float(over[of_fingers].max(initial=-np.inf)),
        float(over[backwards].max(initial=-np.inf)),
    )
