"""Search for a better place of the body, with fixed hands, by cutting planes.

The hands stay in W. A shift d of the body, in the axes of B, moves its centre of mass: the hands
then have to exert the same force f and, about the former origin of B, the moment

    m(d) = m₀ + d × f,    m₀ the moment without a shift.

The least utilisation u is a convex function of the body wrench, hence of d. The multipliers ν of
the balance, ν_m for the moments, give a subgradient: u(d') ≥ u(d) + (f × ν_m)·(d' − d). So each
plan for a shift adds a cut (Kelley 1960), and a small linear program over all cuts gives the next
shift to plan, and a lower bound on u. A tilt about the centre of mass changes neither force nor
moment, only how far the limbs reach and the torques of their joints. Joint angles follow the body:
the subgradient assumes the present angles, but a returned shift is planned with its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Pose, turns_about
from planner import programs
from planner.advice.changes import SETTINGS, Change, pose_message
from planner.advice.trials import StanceTrial, Trials, direction
from planner.prepare import PreparedStance
from planner.programs import WRENCH_UNIT
from planner.result import Distance
from planner.scene import body_clearance, scene_of

__all__ = ["BodySearch", "can_move", "slope"]


def can_move(prepared: PreparedStance) -> bool:
    """Return whether a shift of the body changes the load on the hands.

    False if the question gives a body wrench, or the load exerts no force.
    """
    question = prepared.question
    return question.body_wrench is None and float(np.abs(prepared.wrench[:3]).max()) > 0.0


def slope(trial: StanceTrial) -> Array:
    """Return the gradient of the least utilisation with respect to a shift of the body.

    Parameters
    ----------
    trial : StanceTrial
        Plan at the present place of the body.

    Returns
    -------
    ndarray, shape (3,)
        Gradient in the axes of body frame B [1/m].
    """
    lacking = direction(trial)
    assert lacking is not None
    return np.cross(trial.prepared.wrench[:3], lacking[3:])


class _Cut(NamedTuple):
    """u ≥ value + slope · d; of one that is hard, nothing is known but 0 ≥ value + slope · d."""

    slope: Array
    value: float
    hard: bool = False


class _Tilt(NamedTuple):
    """A turn of the body about its centre of mass: its angle about an axis of B."""

    axis: int = 0
    angle: float = 0.0

    @property
    def turn(self) -> Array:
        return turns_about(self.angle * np.eye(3)[self.axis])


LEVEL_TILT: Final = _Tilt()


class BodySearch:
    """Search for the shift of the body, within the limbs' reach, that lowers the utilisation most.

    Parameters
    ----------
    trials : Trials
        Budget of plans; its unchanged stance is the start.
    """

    def __init__(self, trials: Trials) -> None:
        self.trials, self.prepared = trials, trials.base.prepared
        self.stance, self.range = trials.question.stance, trials.question.body_range
        self._cuts: list[_Cut] = []
        self._known: list[tuple[Array, float]] = []
        self._rock: dict[_Tilt, list[tuple[Array, float]]] = {}
        now = self._nearest(np.zeros(3), LEVEL_TILT)
        # what is in rock today may stay so
        self._allowed = -math.inf if now is None else min(now.distance, 0.0)

    def run(self) -> None:
        """Plan one shift after another, until none can have a lower utilisation than the best.

        Each is the shift with the least lower bound on the utilisation, by the cutting planes so
        far. The search stops, too, once the budget of plans is used up.
        """
        self._keep(np.zeros(3), self.trials.base)
        for _ in range(14):  # plans
            shift, bound = self._next(LEVEL_TILT)
            best = self._best
            if shift is None or self.trials.left <= 0:
                return
            if self._known and best - bound <= SETTINGS.shift_gap * max(best, SETTINGS.shift_gap):
                return
            self._look(shift)

    def changes(self) -> list[Change]:
        """Return the best shift found, and the smallest shift that the cuts predict to be feasible.

        Returns
        -------
        list of Change
            Two at most; empty if no shift was planned, or all are negligible.
        """
        best = self._best
        if not math.isfinite(best):
            return []
        wanted = [(1.0 + SETTINGS.shift_gap) * best]
        cap = self.trials.question.limits.utilisation
        if best < cap and not self.trials.holds(self.trials.base.utilisation):
            wanted.insert(0, cap)
        shifts = [least for level in wanted if (least := self._least(level)) is not None]
        found = [self.change(shift) for shift in shifts]
        if len(found) > 1 and found[0].size > (1.0 - SETTINGS.shift_gap) * found[1].size:
            found.pop()
        return [each for each in found if each.size > SETTINGS.least_shift / SETTINGS.shift_unit]

    def tilts(self) -> list[Change]:
        """Return the best shift combined with tilts of the body.

        Returns
        -------
        list of Change
            With known joints, a change for each tilt. Otherwise that for the tilt whose reach gives
            the lowest bound on the utilisation, if the bound is well below the best utilisation.
        """
        if not self._known or self.range.tilt == 0.0:
            return []
        tilts = [
            _Tilt(axis, way * self.range.tilt)
            for axis in range(3)
            for way in (0.5, -0.5, 1.0, -1.0)
        ]
        if self.prepared.where is not None:
            shift = min(self._known, key=lambda known: known[1])[0]
            return [self.change(shift, tilt) for tilt in tilts]
        reached = [(self._next(tilt), tilt) for tilt in tilts]
        there = [
            (bound, abs(tilt.angle), shift, tilt)
            for (shift, bound), tilt in reached
            if shift is not None
        ]
        if not there:
            return []
        bound, _, shift, tilt = min(there, key=lambda each: each[:2])
        return (
            [self.change(shift, tilt)]
            if bound < (1.0 - 5.0 * SETTINGS.shift_gap) * self._best
            else []
        )

    def grid(self) -> Array:
        """Return shifts on a grid for which all hands are in reach and the body is clear of rock.

        Returns
        -------
        ndarray, shape (s, 3)
            Shifts in the axes of body frame B [m]; the first is zero.
        """
        steps = np.linspace(-self.range.shift, self.range.shift, 7)  # along each axis
        shifts = np.array([(x, y, z) for x in steps for y in steps for z in steps])
        centres, radii = self._reaches(LEVEL_TILT)
        far = np.linalg.norm(shifts[:, None] - centres, axis=2)
        clear = np.array(list(self._clearances(0)))
        fine = (far <= radii).all(axis=1) & (shifts @ clear[:, :3].T <= clear[:, 3]).all(axis=1)
        there = shifts[fine & shifts.any(axis=1)]
        free = [each for each in there if self._rock_plane(each, LEVEL_TILT) is None]
        return np.vstack([np.zeros(3), *free])

    @property
    def _best(self) -> float:
        return min((used for _, used in self._known), default=math.inf)

    def _look(self, shift: Array) -> None:
        """Plan for a shift, and keep what it says."""
        wrench = self.prepared.wrench.copy()
        wrench[3:] += np.cross(shift, wrench[:3])
        self._keep(shift, self.trials.turned(wrench))

    def _keep(self, shift: Array, trial: StanceTrial) -> None:
        outcome = trial.outcome
        if outcome.solved and math.isfinite(trial.utilisation):
            self._known.append((shift, trial.utilisation))
            grows = slope(trial)
            self._cuts.append(_Cut(grows, outcome.value - float(grows @ shift)))
            return
        data = trial.data
        nearest = programs.nearest(data)
        if nearest.solved:
            # w of the hands has n · (w − nearest) ≤ 0
            there = programs.body_wrench(data, nearest.loads)
            n = data.wrench - there
            grows = np.cross(trial.prepared.wrench[:3], n[3:6] / WRENCH_UNIT[3:])
            self._cuts.append(_Cut(grows, float(n @ n) - float(grows @ shift), hard=True))

    def _next(self, tilt: _Tilt) -> tuple[Array | None, float]:
        """Return where the cuts are lowest within reach, and how low."""
        rows = [(*cut.slope, 0.0 if cut.hard else -1.0, -cut.value) for cut in self._cuts]
        found = self._solve(np.array([0.0, 0.0, 0.0, 1.0]), rows, tilt)
        return (None, math.inf) if found is None else (found[:3], float(found[3]))

    def _least(self, level: float) -> Array | None:
        """Return the least shift, by the sum of its components, where no cut is above a level."""
        rows = [
            (*cut.slope, *np.zeros(3), (0.0 if cut.hard else level) - cut.value)
            for cut in self._cuts
        ]
        for axis in np.eye(3):
            rows += [(*axis, *-axis, 0.0), (*-axis, *-axis, 0.0)]
        found = self._solve(np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]), rows, LEVEL_TILT)
        return None if found is None else found[:3]

    def _solve(self, cost: Array, rows: Sequence[Sequence[float]], tilt: _Tilt) -> Array | None:
        """Return the least of cost · x under A x ≤ b, x[:3] a shift within range and reach."""
        centres, radii = self._reaches(tilt)
        rows, most = [*rows, *self._clearances(len(cost) - 3)], self.range.shift
        nothing = np.zeros(len(cost) - 3)
        rows += [(*normal, *nothing, bound) for normal, bound in self._rock.get(tilt, [])]
        bounds = [(-most, most)] * 3 + [(0.0, None)] * (len(cost) - 3)
        for _ in range(30):  # planes that stand for the reaches
            table = np.array(rows).reshape(-1, len(cost) + 1)
            found = scipy.optimize.linprog(
                cost, table[:, :-1], table[:, -1], bounds=bounds, method="highs"
            )
            if found.x is None:
                return None
            away = found.x[:3] - centres
            far = np.sqrt(np.einsum("nx,nx->n", away, away))
            # the linear program keeps to the reaches by so much only
            beyond = far > (1.0 + 1e-6) * radii
            if not beyond.any():
                cut = self._rock_plane(found.x[:3], tilt)
                if cut is None:
                    break
                self._rock.setdefault(tilt, []).append(cut)
                rows.append((*cut[0], *nothing, cut[1]))
            for u, centre, radius in zip(
                away[beyond] / far[beyond, None], centres[beyond], radii[beyond], strict=True
            ):
                rows.append((*u, *nothing, float(u @ centre) + radius))
        return np.asarray(found.x)

    def _clearances(self, further: int) -> Iterator[tuple[float, ...]]:
        """Yield rows that keep the body off the planes of the palms, with columns of zeros."""
        stance = self.stance
        for hand in stance.hands:
            into = hand.pose.rotation[:, 2]
            off = float(into @ (hand.pose.position - stance.body.position))
            # what is nearer today may stay so
            # [m] from B's origin to the plane of a palm, at least
            yield (*(into @ stance.body.rotation), *np.zeros(further), off - min(off, 0.15))

    def _rock_plane(self, shift: Array, tilt: _Tilt) -> tuple[Array, float] | None:
        """Return n, c of n · d ≤ c that takes the body out of rock; None where it is not in any."""
        nearest = self._nearest(shift, tilt)
        if nearest is None or nearest.distance >= self._allowed - SETTINGS.worse_tolerance:
            return None
        one, other = np.array(nearest.points)
        # points lie the other way round where one is in the other
        inward = self.stance.body.rotation.T @ (other - one) / nearest.distance
        return inward, float(inward @ shift) + nearest.distance - self._allowed

    def _nearest(self, shift: Array, tilt: _Tilt) -> Distance | None:
        stance = replace(self.stance, body=self._body(shift, tilt))
        return body_clearance(scene_of(stance, self.prepared.batch.hands))

    def _reaches(self, tilt: _Tilt) -> tuple[Array, Array]:
        """Return balls in which a shift keeps hands in reach: centres (n, 3), radii (n,)."""
        stance = self.stance
        limbs, poses = [h.limb for h in stance.hands], [h.pose for h in stance.hands]
        away, reach = stance.robot.limb_spans(self._body(np.zeros(3), tilt), limbs, poses)
        now, _ = stance.robot.limb_spans(stance.body, limbs, poses)
        # what is out of reach today may stay so
        return away @ tilt.turn.T, np.maximum(reach, np.sqrt(np.einsum("nx,nx->n", now, now)))

    def _body(self, shift: Array, tilt: _Tilt) -> Pose:
        """Return B in W once it is tilted about its centre of mass, and shifted, in its axes."""
        body, turn = self.stance.body, tilt.turn
        centre = self._centre
        return body @ Pose(shift + centre - turn @ centre, turn)

    @property
    def _centre(self) -> Array:
        question, where = self.prepared.question, self.prepared.where
        if question.load.com is not None:
            return np.array(question.load.com)
        return question.stance.robot.com if where is None else where.weights.com

    def change(self, shift: Array, tilt: _Tilt = LEVEL_TILT) -> Change:
        """Return the change of a question that shifts and tilts its body.

        Parameters
        ----------
        shift : ndarray, shape (3,)
            Shift in the axes of body frame B [m].
        tilt : _Tilt, optional
            Rotation of the body about its centre of mass; none by default.
        """
        stance = self.stance
        if np.linalg.norm(shift) < SETTINGS.least_shift:
            shift = np.zeros(3)
        body = self._body(shift, tilt)
        changes: dict[str, Any] = {"stance.body": pose_message(body)}
        if stance.joints is not None:
            changes["stance.joints"] = "solve"
        size = (
            float(np.linalg.norm(shift)) / SETTINGS.shift_unit
            + abs(tilt.angle) / SETTINGS.tilt_unit
        )
        return Change("body", (), ", and ".join(self._words(shift, tilt)), changes, size)

    def _words(self, shift: Array, tilt: _Tilt) -> Iterator[str]:
        along = self.stance.body.rotation @ shift
        values = ", ".join(f"{value:z.3f}" for value in along)
        if shift.any():
            yield f"shift the body by [{values}] m in W"
        if tilt.angle:
            whom = "it" if shift.any() else "the body"
            yield (
                f"tilt {whom} by {math.degrees(tilt.angle):.1f}° about its {'xyz'[tilt.axis]} axis "
                "through its centre of mass"
            )
