"""Search for new holds of limbs, assuming that there is rock; free limbs come first.

The assumed rock equals that under a hand of the stance, and lies in the new hand as in that hand.
Hands that share one rock are not copied, as that rock has one place in W. Candidate places are a
grid, within the limb's reach, on a plane through the hands whose normal is the mean of the palms'.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import permutations
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from hand_models.base import Array, Pose, turns_about
from planner.advice.changes import SETTINGS, Change, hand_path, pose_message
from planner.advice.hands import fingers, rock_pose, unseated
from planner.advice.trials import Trials, Tried
from planner.prepare import PreparedStance

__all__ = ["NewHold", "every_hold", "try_new_holds"]


class _Hold(NamedTuple):
    """A hold that a limb may take.

    Attributes
    ----------
    like : int
        The hand that it is like.
    place : ndarray, shape (3,)
        Of H in W [m].
    turn : float
        About z of the palm, from that hand [rad].
    grasp : float or None
        The turn of outer fingers; that hand's by default [rad].
    """

    like: int
    place: Array
    turn: float
    grasp: float | None = None


class NewHold:
    """Search for a new hold of one limb.

    Parameters
    ----------
    trials : Trials
        Budget of plans.
    limb : str
        Name of the limb that gets the hold.

    Attributes
    ----------
    index : int
        Index of the limb's hand in the question; the number of hands for a free limb.
    best : tuple of (Tried, hold) or None
        Change with the lowest utilisation so far, and its hold.
    places : list of ndarray, shape (3,)
        Candidate places of hand frame H in world frame W [m].
    """

    def __init__(self, trials: Trials, limb: str) -> None:
        self.trials, self.limb = trials, limb
        self.prepared = trials.base.prepared
        limbs = self.prepared.limbs
        self.index = limbs.index(limb) if limb in limbs else len(limbs)
        self.best: tuple[Tried, _Hold] | None = None
        self.places = [*_places(self.prepared, limb)]
        self._seen: set[str] = set()

    @property
    def likes(self) -> list[int]:
        """Indices of the hands that the new hand may copy; hands that share a rock are left out."""
        limbs, shared = self.prepared.limbs, _sharing(self.prepared)
        likes = [i for i in range(len(limbs)) if i != self.index and i not in shared]
        return sorted(likes, key=limbs.__getitem__)

    def probe(self, turns: Sequence[float]) -> None:
        """Plan the new hand at the first place, as a copy of each hand.

        Parameters
        ----------
        turns : sequence of float
            Rotations about z of hand frame H relative to the copied hand [rad].
        """
        if self.places:
            self._try([_Hold(i, self.places[0], turn) for i in self.likes for turn in turns])

    def refine(self) -> None:
        """Plan variants of the best hold so far: rotated, with other grasps, at other places."""
        if self.best is None:
            return
        quarters = SETTINGS.quarter_turns[1:] if self.best[1].turn == 0.0 else ()
        for steps in (quarters, (math.pi / 4.0, -(math.pi / 4.0))):
            now = self.best[1]
            self._try([now._replace(turn=now.turn + step) for step in steps])
        now = self.best[1]
        if self.prepared.question.stance.hands[now.like].placed_hold() is None:
            self._try([now._replace(grasp=grasp) for grasp in SETTINGS.outer_turns])
        now = self.best[1]
        self._try([now._replace(place=place) for place in self.places])

    def _try(self, wanted: Sequence[_Hold]) -> None:
        """Try holds that were not tried before."""
        holds: dict[str, _Hold] = {}
        changes: list[Change] = []
        for hold in wanted:
            change = self.change(hold)
            if change.words not in self._seen:
                self._seen.add(change.words)
                holds[change.words] = hold
                changes.append(change)
        for tried in self.trials.of(changes):
            if self.best is None or tried.utilisation < self.best[0].utilisation:
                self.best = tried, holds[tried.change.words]

    def change(self, hold: _Hold) -> Change:
        """Return the change that puts the limb's hand on a hold.

        Parameters
        ----------
        hold : _Hold
            Index of the hand to copy, place, rotation and grasp.
        """
        stance, new = self.prepared.question.stance, self.index
        hand = stance.hands[hold.like]
        motion = turns_about([0.0, 0.0, hold.turn])
        changes: dict[str, Any] = {
            hand_path(new): hand_path(hold.like),
            hand_path(new, "limb"): self.limb,
            hand_path(new, "pose"): pose_message(Pose(hold.place, hand.pose.rotation @ motion)),
        }
        if hand.placed_hold() is not None or hand.at is not None or hand.seat != "rest":
            seat = self.prepared.batch.hands[hold.like].seating.pose
            changes[hand_path(new, "hold.pose")] = None
            changes[hand_path(new, "hold.pose_in_hand")] = pose_message(seat)
            changes |= unseated(hand, new)
        if hand.at is not None:
            changes[hand_path(new, "place")] = None
        if hand.wrench is not None:
            changes[hand_path(new, "wrench")] = None
        if hold.grasp is not None:
            changes[hand_path(new, "grasp.outer_rotation")] = hold.grasp
        if stance.joints is not None:
            changes["stance.joints"] = "solve"
        return Change(
            kind="new_hold" if new < len(stance.hands) else "free_hand",
            limbs=(self.limb,),
            words=self._words(hand.limb, hold),
            changes=changes,
            size=SETTINGS.hand_size,
        )

    def _words(self, like: str, hold: _Hold) -> str:
        at = ", ".join(f"{value:z.3f}" for value in hold.place)
        degrees = round(math.degrees(math.remainder(hold.turn, 2.0 * math.pi)))
        turned = f"oriented like {like}"
        if degrees:
            turned += f" rotated by {degrees}° about z of its H"
        if hold.grasp is not None:
            turned += f", with {fingers(hold.grasp)}"
        return (
            f"place {self.limb} at [{at}] m in W, {turned}, if there is rock like that under {like}"
        )


def every_hold(trials: Trials, limb: str) -> Iterator[Change]:
    """Yield changes that put a limb at each candidate place, in steps of 45° about z of H.

    Each hand whose rock is not shared is copied in turn.

    Parameters
    ----------
    trials : Trials
        Budget of plans; its unchanged stance is the start.
    limb : str
        Name of the limb.
    """
    search = NewHold(trials, limb)
    turns = [math.radians(turn) for turn in range(-135, 181, 45)]  # [rad] all around
    for place in search.places:
        for like in search.likes:
            for turn in turns:
                yield search.change(_Hold(like, place, turn))


def try_new_holds(trials: Trials) -> None:
    """Plan new holds for all limbs, and refine the best one.

    Parameters
    ----------
    trials : Trials
        Budget of plans, which collects the results.
    """
    limbs = trials.base.prepared.limbs
    found: list[tuple[float, NewHold]] = []
    for limb in trials.question.stance.robot.limbs:
        search = NewHold(trials, limb)
        search.probe(SETTINGS.quarter_turns[:1] if limb in limbs else SETTINGS.quarter_turns)
        if search.best is not None:
            found.append((search.best[0].utilisation, search))
    if found:
        min(found, key=itemgetter(0))[1].refine()


def _sharing(prepared: PreparedStance) -> set[int]:
    """Return the hands whose rock, where it stands in W, is that of another hand."""
    hands = prepared.question.stance.hands
    poses = [rock_pose(prepared, i) for i in range(len(hands))]
    rounding = 1e-6  # [m], and of axes: that of poses of one rock
    return {
        i
        for i, j in permutations(range(len(hands)), 2)
        if hands[i].hold == hands[j].hold
        and np.allclose(poses[i].position, poses[j].position, rtol=0.0, atol=rounding)
        and np.allclose(poses[i].rotation, poses[j].rotation, rtol=0.0, atol=rounding)
    }


def _places(prepared: PreparedStance, limb: str) -> Iterator[Array]:
    """Yield where a limb may hold: where it does, or in the middle first."""
    stance = prepared.question.stance
    others = [hand.pose.position for hand in stance.hands if hand.limb != limb]
    yield from (hand.pose.position for hand in stance.hands if hand.limb == limb)
    normal = np.mean([hand.pose.rotation[:, 2] for hand in stance.hands], axis=0)
    length = float(np.linalg.norm(normal))
    if length < 0.3:  # palms that look all ways have no plane in common
        return
    normal /= length
    chain = stance.robot.chains[limb]
    shoulder = stance.body.apply(chain.shoulder)
    off = float(np.mean([normal @ hand.pose.position for hand in stance.hands]) - normal @ shoulder)
    reach = 0.95 * chain.reach  # share of a limb's reach that a new hold may ask for
    if abs(off) >= reach:
        return
    wide = math.sqrt(reach**2 - off**2)
    x, y = _plane_axes(stance.body.rotation, normal)
    shares = (0.0, -0.6, 0.6)  # of what the limb reaches on the plane, the middle first
    for a in shares:
        for b in shares:
            place = shoulder + off * normal + wide * (a * x + b * y)
            if all(np.linalg.norm(place - other) >= SETTINGS.hands_apart for other in others):
                yield place


def _plane_axes(body: Array, normal: Array) -> tuple[Array, Array]:
    """Return axes in a plane (3,), the first nearest to an axis of the body."""
    along = body - np.outer(normal, normal @ body)
    x = along[:, int(np.argmax(np.linalg.norm(along, axis=0).round(6)))]
    x = x / np.linalg.norm(x)
    return x, np.cross(normal, x)
