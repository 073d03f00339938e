"""The check of one stance's plans, for one body wrench after the other: `check`, prepared.

Every load of a hand with a fixed wrist is affine in what its plan chooses: tensions, lateral
reactions, nails' pulls, the palm's loads. For a stance that stays, the check's own way from these
to tiles, wrenches, limits and joints is worked out once (`planner.verification.hand_check`). A plan
is then checked by one matrix, and by what is not affine: Eq. 21's curve, and the force that a hand
holds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array, skew
from hand_models.hand import SettledHand
from planner.prepare import BALL, Posture, torque_limits
from planner.question import HandOnHold, Question
from planner.robots import LinkTree
from planner.verification.arrays import LOAD, UTILISATION
from planner.verification.check import BALANCE
from planner.verification.hand_check import HandCheck, JointUse, hand_check
from planner.verification.limbs import check_limbs
from planner.verification.limit_surface import LimitCurves
from planner.verification.recomputation import PULLING

__all__ = ["LoadsCheck"]

NOTHING: Final = np.zeros(6)

most = np.maximum.reduce


class LoadsCheck:
    """What loads of a stance do, checked for any body wrench.

    Parameters
    ----------
    question : Question
        With fixed wrists alone and a body wrench, so that nothing accelerates; without present
        tensions.
    settled : sequence of SettledHand
        The hands on their holds.
    columns : sequence of tuple of str
        Names of each hand's loads y.
    where : Posture or None
        The joints.

    Attributes
    ----------
    wrong : list of str
        What is wrong with the stance's joints, whatever its loads.
    idle : float
        Of their joints' torques, what limbs without a hand use.
    """

    def __init__(
        self,
        question: Question,
        settled: Sequence[SettledHand],
        columns: Sequence[tuple[str, ...]],
        where: Posture | None,
    ) -> None:
        places = question.stance.hands
        self.wrong: list[str] = []
        assert question.body_wrench is not None
        check_limbs(self.wrong, question, {}, question.body_wrench, where)
        joints = _joints(question, where)
        limbs = [place.limb for place in places]
        idle = [float(np.abs(use.rest).max()) for limb, use in joints.items() if limb not in limbs]
        self.idle = max(idle, default=0.0)
        self._given = [
            (i, j, value)
            for i, place in enumerate(places)
            for j, value in enumerate(place.wrench or ())
            if value is not None
        ]
        caps = [question.limits.per_hand.get(limb) for limb in limbs]
        self._capped = [
            i
            for i, cap in enumerate(caps)
            if cap is not None and not isinstance(cap.largest_force, tuple)
        ]
        hands = [
            hand_check(question, place, hand, names, joints.get(place.limb))
            for place, hand, names in zip(places, settled, columns, strict=True)
        ]
        self._stack(hands)
        carries = np.array([_carry(question, place) for place in places])
        self._body = np.hstack(list(carries @ self._matrix[:, self._wrench]))
        self._from_rest = np.einsum("hij,hj->i", carries, self._constant[:, self._wrench])
        self._planes = [hand.planes for hand in hands]
        shares = np.ones((len(hands), max(len(hand.planes) for hand in hands)))
        for own, hand in zip(shares, hands, strict=True):
            own[: len(hand.engagement)] = hand.engagement
        of_tile = np.repeat(np.arange(len(hands)), shares.shape[1])
        self._curves = LimitCurves([hand.surface for hand in settled], of_tile, shares.ravel())

    def _stack(self, hands: Sequence[HandCheck]) -> None:
        """Put each hand's rows into a matrix, filled up with rows that are never wrong."""
        parts = [
            *(([hand.tiles[k] for hand in hands], 0.0) for k in range(3)),
            ([hand.palm for hand in hands], 0.0),
            ([hand.wrench for hand in hands], 0.0),
            ([hand.held for hand in hands], 0.0),
            ([hand.hard for hand in hands], np.inf),
            ([hand.used for hand in hands], -np.inf),
        ]
        counts = [max(len(own) for own in rows) for rows, _ in parts]
        columns = max(hand.wrench.shape[1] for hand in hands)
        self._matrix = np.zeros((len(hands), sum(counts), columns - 1))
        self._constant = np.zeros((len(hands), sum(counts)))
        slices, at = [], 0
        for (rows, missing), count in zip(parts, counts, strict=True):
            self._constant[:, at : at + count] = missing
            for i, own in enumerate(rows):
                self._matrix[i, at : at + len(own), : own.shape[1] - 1] = own[:, :-1]
                self._constant[i, at : at + len(own)] = own[:, -1]
            slices.append(slice(at, at + count))
            at += count
        self._shear, self._normal, self._lateral, palm, self._wrench, self._held = slices[:6]
        self._hard, self._used = slices[6:]
        self._carried = slice(0, palm.stop)
        self._least, self._growing = np.zeros((2, len(hands), counts[6]))
        for i, hand in enumerate(hands):
            self._least[i, : len(hand.slack)] = -hand.slack[:, 0]
            self._growing[i, : len(hand.slack)] = hand.slack[:, 1]

    def fault(
        self, loads: Array, wrenches: Array, utilisation: float, body_wrench: Array
    ) -> str | None:
        """Return what is wrong with a plan's numbers; None if nothing is.

        Parameters
        ----------
        loads : ndarray, shape (hands, m)
            y of each hand, filled up with zeros [N].
        wrenches : ndarray, shape (hands, 6)
            On the rock, in each H.
        utilisation : float
            Of the whole stance, limbs without a hand included.
        body_wrench : ndarray, shape (6,)
            In B.
        """
        found = (self._matrix @ loads[:, :, None])[:, :, 0]
        found += self._constant
        own, used = found[:, self._wrench], found[:, self._used]
        largest = max(1.0, float(most(np.abs(found[:, self._carried]), axis=None)))
        allowed = LOAD * largest
        size = math.sqrt(float(body_wrench @ body_wrench))
        off = self._body @ loads.ravel()
        off += self._from_rest
        off -= body_wrench
        again = max(float(most(used, axis=None)), 0.0, self.idle)
        hard = largest * self._growing
        hard += found[:, self._hard]
        # each in terms that are false where a number is not finite
        if not math.sqrt(float(off @ off)) <= BALANCE * max(size, 1.0):
            return "the balance"
        if not float(most(np.abs(own - wrenches), axis=None)) <= allowed:
            return "a hand's wrench"
        if not (hard >= self._least).all():
            return "a load of the wrong sign"
        if not abs(again - utilisation) <= UTILISATION * max(1.0, again):
            return "the utilisation"
        if not self._holds(own, found[:, self._held], allowed):
            return "what a hand holds"
        for h, i, value in self._given:
            if not abs(own[h, i] - value) <= allowed:
                return "a wrench that is given"
        for h in self._capped:
            if not np.linalg.norm(own[h, :3]) <= (BALL @ own[h, :3]).max() + allowed:
                return "a force that is capped"
        return self._outside(found, used, allowed)

    def _holds(self, wrenches: Array, along: Array, allowed: float) -> bool:
        """Whether each hand holds no more, across the rock and away from it, than its rows say."""
        forces = np.minimum(wrenches[:, :3], PULLING)
        held = np.sqrt(np.einsum("hx,hx->h", forces, forces))
        return bool((held <= most(along, axis=1) + allowed).all())

    def _outside(self, found: Array, used: Array, allowed: float) -> str | None:
        """Say whether a tile is outside Eq. 21's surface, though within its half-planes."""
        shear, normal = found[:, self._shear].ravel(), found[:, self._normal].ravel()
        lateral = found[:, self._lateral].ravel()
        inside = self._curves.excess(shear, normal, lateral, UTILISATION) <= allowed
        if not inside.all():
            # beyond its half-planes a tile may be outside the surface, too
            for h, k in np.argwhere(~inside.reshape(len(found), -1)):
                if used[h, self._planes[h][k]].max() <= 1.0:
                    return "a tile's limit curve"
        return None


def _carry(question: Question, place: HandOnHold) -> Array:
    """Return what carries a hand's wrench on the rock to the rock's reaction in B, (6, 6)."""
    body = question.stance.body
    turn = body.rotation.T @ place.pose.rotation
    lever = body.rotation.T @ (place.pose.position - body.position)
    carry = np.zeros((6, 6))
    carry[:3, :3] = carry[3:, 3:] = -turn
    carry[3:, :3] = -skew(lever) @ turn
    return carry


def _joints(question: Question, where: Posture | None) -> Mapping[str, JointUse]:
    """Return what every limb's joints use, from the robot's links; nothing without joints."""
    if where is None:
        return {}
    robot, stance = question.stance.robot, question.stance
    tree, limits = LinkTree(robot), torque_limits(question)
    gravity = stance.body.rotation.T @ stance.gravity
    rest, *pushed = (
        tree.hold_up(where.angles, dict.fromkeys(robot.limbs, wrench), gravity, NOTHING).torques
        for wrench in (NOTHING, *np.eye(6))
    )
    return {
        limb: JointUse(
            rest[limb] / limits[limb],
            np.column_stack([one[limb] - rest[limb] for one in pushed]) / limits[limb][:, None],
        )
        for limb in robot.limbs
    }
