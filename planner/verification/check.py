"""Check every plan before it is returned: recompute all limits and laws from the plan's numbers.

Nothing is shared with the computation of the plan. The plan's forces must balance every joint and
tendon (`joint_balance`), without the affine maps of Eq. 14; motors, winches and nails must fit
(`fingers`); wrenches are summed force by force (`hands`); limits are Eq. 21 itself and the plan's
half-planes (`tiles`), and the published figures of the structure; the balance is summed about the
body's origin. `floating` has what differs for a floating wrist, `limbs` the joints and the limits
that a question adds.

Each of these is one kind of `ResidualLimits` and recomputes its residuals for all hands at once, in
arrays. If all residuals are tiny, the plan passes; otherwise each residual is compared with its
tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import SKEW_MATRICES, Array, BoundedStore
from planner.prepare import HandBatch, Posture
from planner.question import HandOnHold, LostTile, Question, Stance
from planner.result import PlanArrays
from planner.verification.fingers import DriveLimits, NailLimits, TwistLimits
from planner.verification.floating import floating_fingers, recompute_floating
from planner.verification.hands import HandLimits, check_contacts
from planner.verification.joint_balance import JointBalance
from planner.verification.limbs import AskedLimits, JointUse, check_limbs, recompute_joints
from planner.verification.residuals import (
    FINGER_COUNT,
    TOLERANCES,
    PartNames,
    Recomputed,
    Residual,
    ResidualLimits,
    allowed_errors,
    claim,
    is_near,
)
from planner.verification.slips import SlippedTiles
from planner.verification.tiles import TileLimits

__all__ = ["Check"]


class SettledLimits:
    """The limits of settled hands on their holds, without those that a question adds.

    Parameters
    ----------
    known : HandBatch
        The hands on their holds.
    places : sequence of HandOnHold
        Limb, wrist and tendon preload of each hand. The preload (4,) has the tensions to which the
        motors of a floating hand have tightened its tendons [N]; by default the closing tension.
    strength : float
        Largest tension of every tendon [N].
    before : SettledLimits, optional
        Limits of the same hands before tiles slipped, from which what stays is taken over.

    Attributes
    ----------
    names : PartNames
        Names of the hands' parts.
    wound : dict of int to float or ndarray, shape (4,)
        Tensions to which the tendons of each floating hand are tightened, by hand index [N].
    tiles : TileLimits
        Limits of the tiles.
    nails : NailLimits
        Limits of the nails; `recompute` has their residuals.
    limits : tuple of ResidualLimits
        All limits but those of nails.
    """

    def __init__(
        self,
        known: HandBatch,
        places: Sequence[HandOnHold],
        strength: float,
        before: SettledLimits | None = None,
    ) -> None:
        self._balance: JointBalance
        self._twists: TwistLimits
        self.names = names = PartNames(tuple([place.limb for place in places]), known)
        self.wound = {
            h: known.hands[h].closing_tension
            if place.tendon_preload is None
            else place.tendon_preload
            for h, place in enumerate(places)
            if place.wrist == "floating"
        }
        giving = {
            h: place.wrist == "compliant"
            for h, place in enumerate(places)
            if place.wrist != "fixed"
        }
        self._giving = list(giving)
        self._floating = floating_fingers(known.hands, giving) if giving else None
        whole = None if before is None else before._balance
        self._balance = balance = JointBalance(names, self._giving, whole)
        self.nails = nails = NailLimits(names)
        if before is None:
            drives = DriveLimits(names, balance.left, strength, nails.fingers)
        else:
            drives = before._drives.after_slips(names)
        self._drives: DriveLimits = drives
        self.tiles = tiles = TileLimits(names, nails.tiles)
        self._twists = TwistLimits(known) if before is None else before._twists
        self.limits = (balance, tiles, drives, self._twists, HandLimits(names))

    def recompute(self, found: list[str], arrays: PlanArrays) -> Recomputed:
        """Recompute the tile loads from a plan's tensions, or for floating wrists from their poses.

        Parameters
        ----------
        found : list of str
            Error messages so far; further ones are appended.
        arrays : PlanArrays
            The plan's numbers.
        """
        balance, f, lateral = self._balance, arrays.tensions, arrays.loads[:, 2]
        nails = self.nails.recompute(arrays)
        rest = self._floating
        # wrists of other hands than the question's are refused by `Check`
        if rest is None or [h for h, each in enumerate(arrays.wrists) if each] != self._giving:
            loads, left = balance.loads(f, lateral)
            return Recomputed(arrays, loads, left, f, loads[:, 0], nails)
        # motors of hands that float stand still where they have tightened their tendons, those of
        # compliant ones keep the tension
        wound = f.copy()
        for h, tension in self.wound.items():
            wound[FINGER_COUNT * h : FINGER_COUNT * (h + 1)] = tension
        shear, normal, left = recompute_floating(found, self.names, balance, rest, arrays, wound)
        loads, (drawn, _) = np.column_stack((shear, normal, lateral)), balance.loads(wound, lateral)
        return Recomputed(arrays, loads, left, wound, drawn[:, 0], nails)


SETTLED_LIMITS: Final[BoundedStore[Hashable, SettledLimits]] = BoundedStore(
    "limits of settled hands", 64
)
"""Limits for checks, by the hands, limbs, wrists, strength and preloads: the last ones."""


def _settled_limits(
    known: HandBatch,
    places: Sequence[HandOnHold],
    strength: float,
    before: SettledLimits | None,
) -> SettledLimits:
    preloads = [place.tendon_preload for place in places]
    wound = tuple([None if preload is None else preload.tobytes() for preload in preloads])
    names = tuple([(place.limb, place.wrist) for place in places])
    key = known.hands, names, wound, strength
    return SETTLED_LIMITS.get(key, lambda: SettledLimits(known, places, strength, before))


class Check:
    """The check of plans for a stance, prepared once for its settled hands.

    Parameters
    ----------
    question : Question
        Stance, limits and load. Its body wrench only counts where joints carry the robot's weight.
    known : HandBatch
        The hands on their holds.
    where : Posture, optional
        Joint angles and joint loads; None if the question has no joints.
    lost : sequence of LostTile, optional
        The tiles that have slipped; none by default.
    before : Check, optional
        The check of the same stance before tiles slipped, from which all that stays is taken over:
        where hands and fingers are.

    Attributes
    ----------
    question, known, where
        The parameters.
    strength : float
        Largest tension of every tendon [N].
    settled : SettledLimits
        Limits of the hands on their holds.
    limbs : tuple of str
        Limb of each hand.
    carry : ndarray, shape (6, 6 H)
        Map from the wrenches of the H hands on the rock, each in its H, to the rock's reaction on
        the robot in B.
    """

    def __init__(
        self,
        question: Question,
        known: HandBatch,
        where: Posture | None = None,
        lost: Sequence[LostTile] = (),
        before: Check | None = None,
    ) -> None:
        self.settled: SettledLimits
        self.carry: Array
        hands, stance, limits = known.hands, question.stance, question.limits
        self.question, self.where, self.known = question, where, known
        cap, most = limits.tendon_tension, hands[0].hand.maximum_tension
        self.strength = most if cap is None else min(most, cap)
        same = before is None or all(
            now.as_closed is then for now, then in zip(hands, before.known.hands, strict=True)
        )
        if not same or (before is not None and before.question.stance is not stance):
            raise ValueError("the check before tiles slipped is of another stance")
        whole = None if before is None else before.settled
        self.settled = _settled_limits(known, stance.hands, self.strength, whole)
        self.limbs = self.settled.names.limbs
        asked = AskedLimits(question, self.settled.names, self.settled.tiles)
        self._limits: tuple[ResidualLimits, ...] = (*self.settled.limits, asked)
        self._slipped: SlippedTiles | None = None
        if lost or not all(hand.closed is None for hand in hands):
            closed = None if before is None else before.known.touch.contacts
            self._slipped = SlippedTiles(self.settled.names, lost, closed)
            self._limits += (self._slipped,)
        self.carry = _carry(stance) if before is None else before.carry

    def problems(
        self,
        arrays: PlanArrays,
        utilisation: float,
        body_wrench: Array,
        effort: float | None = None,
    ) -> list[str]:
        """Check a plan; return an error message for each failure, and nothing if the plan passes.

        Parameters
        ----------
        arrays : PlanArrays
            The plan's numbers.
        utilisation : float
            The plan's utilisation.
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        effort : float, optional
            The plan's effort; not checked by default.

        Returns
        -------
        list of str
            One sentence for each failure.
        """
        found: list[str] = []
        with np.errstate(invalid="ignore", over="ignore"):
            joints = self.joints(found, arrays.wrenches, body_wrench)
            residuals, _, used = self.recompute(found, arrays, joints)
            misplaced = [*self._wrists(arrays), *check_contacts(self.settled.names, arrays)]
            if self._slipped is not None:
                misplaced += self._slipped.contacts()
            if misplaced or not is_near(residuals):
                allowed = allowed_errors(self.known, arrays)
                for residual in residuals:
                    found.extend(residual.off(allowed))
                found.extend(misplaced)
            worst = max(float(np.maximum.reduce(used)), self.idle(joints))
            if not abs(worst - utilisation) <= TOLERANCES.utilisation * max(1.0, worst):
                found.append(f"plan: utilisation is {worst:.8g}, not {utilisation:.8g}")
            found.extend(self.unbalanced(arrays.wrenches, body_wrench))
            if effort is not None:
                relative = float(arrays.tensions.dot(arrays.tensions)) / self.strength**2
                own = [joints[limb].shares for limb in self.limbs if limb in joints]
                relative += sum(float(shares @ shares) for shares in own)
                if not abs(relative - effort) <= 1e-6 * max(1.0, relative):
                    found.append(f"plan: effort is {relative:.8g}, not {effort:.8g}")
        return list(dict.fromkeys(found))

    def joints(self, found: list[str], wrenches: Array, body_wrench: Array) -> dict[str, JointUse]:
        """Check the limbs' joints; return the loads of the joints, by limb.

        Parameters
        ----------
        found : list of str
            Error messages so far; further ones are appended.
        wrenches : ndarray, shape (H, 6)
            Wrench of each hand on the rock, in its H [N, N·m].
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        if self.where is None and self.question.stance.joints is None:
            return {}
        by_limb = dict(zip(self.limbs, wrenches, strict=True))
        return check_limbs(found, self.question, by_limb, body_wrench, self.where)

    def idle(self, joints: Mapping[str, JointUse]) -> float:
        """Return the largest joint utilisation of limbs without a hand; zero without such limbs."""
        alone = [use for limb, use in joints.items() if limb not in self.limbs]
        return max([float(np.abs(use.shares).max()) for use in alone], default=0.0)

    def recompute(
        self, found: list[str], arrays: PlanArrays, joints: Mapping[str, JointUse]
    ) -> tuple[list[Residual], Recomputed, Array]:
        """Recompute all residuals of the hands, and their utilisations, from a plan's numbers.

        Parameters
        ----------
        found : list of str
            Error messages so far; further ones are appended.
        arrays : PlanArrays
            The plan's numbers.
        joints : mapping of str to JointUse
            Loads of the limbs' joints.

        Returns
        -------
        residuals : list of Residual
            Residuals of all limits, and the errors of the reported utilisations.
        again : Recomputed
            The plan's numbers and the recomputed tile loads.
        used : ndarray, shape (H,)
            Utilisation of each hand.
        """
        again = self.settled.recompute(found, arrays)
        residuals: list[Residual] = []
        for limits in self._limits:
            residuals += limits.recompute(again)
            residuals += limits.recompute_curved(arrays, again.loads, arrays.wrenches)
        residuals += again.nails.residuals
        for h, limb in enumerate(self.limbs):
            if limb in joints:
                residuals += recompute_joints(limb, h, joints[limb])
        uses = [each for each in residuals if each.kind == "use"]
        rows = np.concatenate([np.maximum.reduce(each.values, axis=1) for each in uses])
        used = np.zeros(len(self.limbs))
        np.maximum.at(used, np.concatenate([each.hand for each in uses]), rows)
        name, said, hand = self.settled.names.limb, arrays.utilisations, np.arange(len(used))
        residuals.append(claim(used, said, hand, TOLERANCES.utilisation, name, "utilisation"))
        return residuals, again, used

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return the residuals of all limits that are not affine in the loads.

        Parameters as in `ResidualLimits.recompute_curved`.
        """
        of_all = [limits.recompute_curved(arrays, loads, wrenches) for limits in self._limits]
        return [residual for residuals in of_all for residual in residuals]

    def unbalanced(self, wrenches: Array, body_wrench: Array) -> Iterator[str]:
        """Yield an error message if the hands' wrenches do not balance the body wrench.

        Parameters
        ----------
        wrenches : ndarray, shape (H, 6)
            Wrench of each hand on the rock, in its H [N, N·m].
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        error = self.carry @ wrenches.ravel() - body_wrench
        off, size = math.sqrt(error.dot(error)), math.sqrt(body_wrench.dot(body_wrench))
        if not off <= TOLERANCES.balance * max(size, 1.0):
            yield f"balance is off by {off:.3g} of {size:.3g}"

    def _wrists(self, arrays: PlanArrays) -> Iterator[str]:
        """Yield hands whose wrists are not what they are in the question."""
        stance = self.question.stance
        stiffness = None if stance.limb_stiffness is None else np.array(stance.limb_stiffness.each)
        hands = zip(stance.hands, arrays.wrists, arrays.wrenches, strict=True)
        for place, wrist, wrench in hands:
            mode = "fixed" if wrist is None else ("compliant" if wrist.driven else "floating")
            if mode != place.wrist:
                yield f"{place.limb}: the wrist is not {place.wrist}"
            target = None if wrist is None else wrist.pose_target
            if wrist is None or (target is None and stiffness is None):
                continue
            off = np.inf
            if target is not None and stiffness is not None:
                off = np.abs(stiffness * (target - wrist.twist) - wrench).max()
            if not off <= 1e-9 * max(1.0, np.abs(wrench).max()):  # by rounding
                yield f"{place.limb}: a limb that aims at its pose target exerts another wrench"


def _carry(stance: Stance) -> Array:
    """Return the map from the hands' wrenches to the rock's reaction, `Check.carry`."""
    poses = [place.pose for place in stance.hands]
    into_body = stance.body.rotation.T
    turns = into_body @ np.concatenate([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    levers = (np.array([pose.position for pose in poses]) - stance.body.position) @ into_body.T
    carry = np.zeros((len(poses), 6, 6))
    carry[:, :3, :3] = carry[:, 3:, 3:] = turns
    carry[:, 3:, :3] = (levers @ SKEW_MATRICES.reshape(3, 9)).reshape(-1, 3, 3) @ turns
    return np.asarray(-carry.transpose(1, 0, 2).reshape(6, -1))
