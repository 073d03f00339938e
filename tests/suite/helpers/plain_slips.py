"""A plain simulator of slips, one draw and one tile at a time, from a hand's springs and tendons.

It shares nothing with `planner.simulation` but the rules: joints are balanced by Eq. 4 written out
for each finger, passive loads by a program of CVXPY, all forces are summed in the world.
"""

from __future__ import annotations

from collections.abc import Sequence

import cvxpy as cp
import numpy as np

from hand_models.hand import FINGERS
from planner import Plan
from planner.prepare import PreparedStance

PHALANGES = ("proximal", "middle", "distal")
RUBS, SOFT, MOVED = 0.005, 1e-2, 0.1


class LostError(Exception):
    """A hand holds no more, or nothing balances the body."""


class PlainSlips:
    """A plan whose tiles slip. A tile is named by hand and index, a palm by hand and None."""

    def __init__(self, prepared: PreparedStance, plan: Plan) -> None:
        self.prepared, self.plan = prepared, plan
        self.state: dict[tuple[int, int], str] = {}
        self.palms = [True] * len(plan.hands)
        self.size = max(1.0, max(float(np.abs(hand.loads).max()) for hand in plan.hands))
        for h, hand in enumerate(plan.hands):
            for t, tile in enumerate(hand.tiles):
                if tile.contact in ("face", "edge"):
                    self.state[h, t] = "holds"
                elif tile.contact == "frame":
                    self.state[h, t] = "frame"
        self.start = {h for h, _ in self.holding()}

    def holding(self):
        return [key for key, state in self.state.items() if state == "holds"]

    def finger_loads(self, h: int, i: int) -> dict[int, tuple[float, float]]:
        """Shear and normal load of each of a finger's tiles, by Eq. 4."""
        hand, settled = self.plan.hands[h], self.prepared.batch.hands[h]
        own = [t for t, tile in enumerate(hand.tiles) if tile.finger == FINGERS[i]]
        base = [t for t in own if hand.tiles[t].phalanx == "base"]
        on = {p: next(t for t in own if hand.tiles[t].phalanx == p) for p in PHALANGES}
        finger, f = settled.fingers[i], float(hand.tensions[i])
        model, mu = finger.model, settled.surface.friction
        drawn = finger.shears(settled.closing_tension, bool(base)) @ [1.0, f]
        kinds = [self.state.get((h, on[p]), "off") for p in PHALANGES]
        # each phalanx takes the nearest joint before it that no stop holds
        free = [j for j in range(3) if finger.contacts[j].stop is None]
        joint = {}
        for j in range(3):
            if finger.contacts[j].kind != "none":
                joint[j] = max(each for each in free if each <= j)
                free.remove(joint[j])
        bears = [j for j in joint if kinds[j] != "off"]
        A, b = np.zeros((len(bears), len(bears))), np.zeros(len(bears))
        tension = f * model.losses(bool(base))
        for row, j in enumerate(bears):
            i0 = joint[j]
            q = finger.joint_angles[i0]
            b[row] = tension[i0] * model.pulley_radii[i0] - model.joint_stiffness[i0] * q
            b[row] -= model.joint_preload[i0]
            for column, k in enumerate(bears):
                if k < i0:
                    continue
                d = finger.points[k] - np.array(finger.contacts[i0].joint)
                u = finger.directions[k]
                n = np.array([-u[1], u[0]])
                shear, normal = d[0] * u[1] - d[1] * u[0], d[0] * n[1] - d[1] * n[0]
                A[row, column] += normal
                if kinds[k] == "drags":
                    A[row, column] -= shear * mu
                elif kinds[k] == "holds":
                    b[row] += shear * drawn[k]
            # a contact that bears a share takes that of what the others leave of its joint
            mine, share = A[row, row], finger.contacts[j].bearing_share
            A[row], b[row] = share * A[row], share * b[row]
            A[row, row] = mine
        N = np.linalg.solve(A, b) if bears else b
        found = dict.fromkeys(own, (0.0, 0.0))
        for row, j in enumerate(bears):
            T = {"drags": mu * N[row], "holds": drawn[j]}.get(kinds[j], 0.0)
            found[on[PHALANGES[j]]] = float(T), float(N[row])
        for t in base:
            if self.state.get((h, t)) == "holds":
                found[t] = float(settled.loads[t, 0] @ [1.0, f]), 0.0
        return found

    def rest(self, h: int, i: int) -> None:
        """Take off what cannot hold, the worst first, until a finger rests."""
        settled = self.prepared.batch.hands[h]
        mu, gives = settled.surface.friction, settled.drag_allowances
        while True:
            loads, short = self.finger_loads(h, i), {}
            for t, (T, N) in loads.items():
                state = self.state.get((h, t))
                if settled.tiles[t].phalanx == "base":
                    continue
                if state == "holds":
                    short[t] = T + mu * N + gives[t]
                elif state in ("drags", "frame"):
                    short[t] = N
            worst = min(short, key=short.__getitem__, default=None)
            if worst is None or short[worst] >= -3e-6 * self.size:
                break
            self.state[h, worst] = "off"
        for t, (T, _) in loads.items():
            if settled.tiles[t].phalanx == "base" and self.state.get((h, t)) == "holds":
                pressed = settled.engagement[t] * loads[t + 1][1]
                if T + mu * pressed + gives[t] < -3e-6 * self.size:
                    self.state[h, t] = "off"

    def slip(self, key: tuple[int, int | None]) -> None:
        """Let a tile or a palm slip."""
        h, t = key
        if t is None:
            self.palms[h] = False
            return
        hand = self.plan.hands[h]
        i = FINGERS.index(hand.tiles[t].finger)
        if hand.tiles[t].phalanx == "base":
            self.state[key] = "off"
            return
        self.state[key] = "drags" if self.finger_loads(h, i)[t][1] >= 0.0 else "off"
        self.rest(h, i)

    def used(self) -> dict[tuple[int, int | None], float]:
        """What each tile and palm that holds uses of its strength; an error without balance."""
        stance = self.prepared.question.stance
        body, planar = stance.body, {}
        missing, columns = np.zeros(6), []
        held = self.holding()
        if {h for h, _ in held} != self.start:
            raise LostError

        def in_body(h: int, force: np.ndarray, place: np.ndarray) -> np.ndarray:
            pose = stance.hands[h].pose
            at = pose.rotation @ place + pose.position - body.position
            turned = pose.rotation @ force
            wrench = [body.rotation.T @ turned, body.rotation.T @ np.cross(at, turned) / 0.1]
            return np.concatenate(wrench)

        for h, hand in enumerate(self.plan.hands):
            settled = self.prepared.batch.hands[h]
            for t, load in enumerate(hand.loads):
                missing += in_body(h, load @ hand.axes[t], hand.positions[t])
            missing += in_body(h, hand.palm.force, hand.palm.position)
            for i, name in enumerate(FINGERS):
                loads = self.finger_loads(h, i)
                for t, (T, N) in loads.items():
                    planar[h, t] = T, N
                    force = T * hand.axes[t, 0] + N * hand.axes[t, 1]
                    missing -= in_body(h, force, hand.positions[t])
                own = [t for t in loads if self.state.get((h, t)) == "holds"]
                spines = sum(settled.engagement[t] for t in own)
                whole = sum(settled.engagement[t] for t in loads if settled.touching[t])
                before = sum(hand.loads[t, 2] for t in loads)
                if spines > 0.0:
                    stiff = settled.hand.lateral_stiffness * spines * settled.grasp.lateral
                    wrench = sum(
                        settled.engagement[t]
                        / spines
                        * in_body(h, hand.axes[t, 2], hand.positions[t])
                        for t in own
                    )
                    columns.append(
                        ((h, name), wrench, before * spines / whole, stiff, -np.inf, np.inf)
                    )
            palm, place = settled.palm, hand.palm.position
            if palm.engaged:
                pressing = sum(palm.engagement) * settled.hand.palm_pressing_stiffness
                if self.palms[h]:
                    along = in_body(h, np.array([-1.0, 0.0, 0.0]), place)
                    shear = settled.palm_shear_stiffness
                    columns.append(
                        ((h, "shear"), along, -float(hand.palm.force[0]), shear, 0.0, np.inf)
                    )
                up = in_body(h, np.array([0.0, 0.0, 1.0]), place)
                most = max(palm.pressing_limit, float(hand.palm.force[2]))
                columns.append(((h, "press"), up, float(hand.palm.force[2]), pressing, 0.0, most))
        passive = self._passive(columns, missing)
        found: dict[tuple[int, int | None], float] = {}
        for h, t in held:
            hand, settled = self.plan.hands[h], self.prepared.batch.hands[h]
            own = [s for g, s in held if g == h and hand.tiles[s].finger == hand.tiles[t].finger]
            share = settled.engagement[t] / sum(settled.engagement[s] for s in own)
            Y = share * passive.get((h, hand.tiles[t].finger), 0.0)
            T, N = planar[h, t]
            found[h, t] = max(
                (p.a_shear * T + p.a_normal * N + p.a_lateral * abs(Y)) / p.capacity
                for p in hand.limits_of(t)
            )
        for h, settled in enumerate(self.prepared.batch.hands):
            if self.palms[h] and settled.palm.engaged:
                found[h, None] = passive[h, "shear"] / settled.palm.shear_limit
        return found

    def _passive(self, columns: Sequence[tuple], missing: np.ndarray) -> dict:
        """Least elastic energy of the changes of laterals, palms and friction."""
        names, wrenches, x0, k, low, high = zip(*columns, strict=True)
        G, x0, k = np.array(wrenches), np.array(x0), np.array(k)
        x, e = cp.Variable(len(x0)), cp.Variable(6)
        rubs = RUBS * max(1.0, float(np.linalg.norm(self.prepared.wrench[:3])))
        soft = SOFT * self.prepared.batch.hands[0].hand.lateral_stiffness
        moves = k > 0.0
        weights = np.where(moves, 1.0 / np.where(moves, k, 1.0), 0.0)
        unit = 1e5  # N/m
        energy = cp.sum(cp.multiply(unit * weights, cp.square(x - x0)))
        energy += unit / soft * cp.sum_squares(e)
        limits = [G.T @ x + e == missing, cp.abs(e) <= rubs]
        limits += [
            x[j] == x0[j] if not moves[j] else x[j] >= low[j]
            for j in range(len(x0))
            if not moves[j] or np.isfinite(low[j])
        ]
        limits += [x[j] <= high[j] for j in range(len(x0)) if moves[j] and np.isfinite(high[j])]
        problem = cp.Problem(cp.Minimize(energy), limits)
        problem.solve(solver=cp.CLARABEL, tol_gap_abs=1e-10, tol_gap_rel=1e-10, tol_feas=1e-10)
        if problem.status not in ("optimal", "optimal_inaccurate"):
            raise LostError
        # the multipliers of the balance are the way of the body
        if np.abs(limits[0].dual_value).max() / (2.0 * unit) > MOVED:
            raise LostError
        return dict(zip(names, x.value.tolist(), strict=True))

    def run(self, strength: dict[tuple[int, int | None], float]) -> tuple[bool, list]:
        """Let the weakest slip until all rest; whether all hands hold, and what has slipped."""
        slipped: list[tuple[int, int | None]] = []
        while True:
            try:
                over = {key: used / strength[key] for key, used in self.used().items()}
            except LostError:
                return False, slipped
            weakest = max(over, key=over.__getitem__)
            if over[weakest] <= 1.0:
                return True, slipped
            slipped.append(weakest)
            self.slip(weakest)
