"""Check the loads of a stance fast, for one body wrench after the other.

All loads of a hand with a fixed wrist are affine in the variables of its plan (tensions, lateral
reactions, forces of nails, loads of the palm), and so are most residuals of the check
(`Residual.affine`). For a stance that stays, these residuals are tabulated at zero and for one
newton of each variable. A residual that is zero there is zero for all loads and is left out. A plan
is then checked by one matrix product, and by the residuals that are not affine.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.hand import FINGERS, NAIL
from planner.result import LoadRecovery, PlanArrays
from planner.verification.check import Check
from planner.verification.hands import check_contacts
from planner.verification.residuals import TOLERANCES

__all__ = ["LoadsCheck"]

most = np.maximum.reduce


class LoadsCheck:
    """The check of a stance's loads for any body wrench, in one matrix product.

    Parameters
    ----------
    check : Check
        Check of the stance's plans. All wrists are fixed, the question has a body wrench, and it
        has no present tensions.
    reader : LoadRecovery
        Converts the hands' loads to a plan's numbers.
    columns : sequence of tuple of str
        Names of each hand's loads y.

    Attributes
    ----------
    wrong : list of str
        Error messages about the stance that do not depend on its loads.
    idle : float
        Largest joint utilisation of limbs without a hand.
    """

    def __init__(
        self, check: Check, reader: LoadRecovery, columns: Sequence[tuple[str, ...]]
    ) -> None:
        self._check, self._reader, self._columns = check, reader, columns
        self._size = max(map(len, columns))
        # what a load may add to a number that is zero: so much each, and as much without any
        self._negligible = 0.5 * TOLERANCES.near / (1.0 + self._size)
        self.wrong: list[str] = []
        self.idle = 0.0
        rest, *loaded = [self._numbers(y) for y in np.eye(self._size + 1, self._size, k=-1)]
        parts = []
        for i, (kind, values, hand) in enumerate(rest):
            slopes = [each[i][1] - values for each in loaded]
            rows = np.stack([values, *slopes], axis=-1).reshape(-1, self._size + 1)
            owner = hand.repeat(len(rows) // len(hand)) if len(hand) else hand
            kept = self._matters(kind, rows)
            parts.append((kind, rows[kept], owner[kept]))
        # what more is computed of, then residuals; an error is a least value over its own
        kinds = ("load", "palm", "wrench", "zero", "least", "error", "use")
        parts.sort(key=lambda part: kinds.index(part[0]))
        sizes = [sum(len(rows) for kind, rows, _ in parts if kind == each) for each in kinds]
        ends = np.cumsum([0, *sizes]).tolist()
        self._of = dict(zip(kinds, map(slice, ends[:-1], ends[1:]), strict=True))
        rows, owner = (np.concatenate([part[i] for part in parts]) for i in (1, 2))
        matrix = np.zeros((len(rows), len(columns), self._size))
        matrix[np.arange(len(rows)), owner] = rows[:, 1:]
        self._constant, self._matrix = rows[:, 0].copy(), matrix.reshape(len(rows), -1)

    def _numbers(self, y: Array) -> list[tuple[str, Array, Indices]]:
        """Return the check's numbers of loads, the same y of each hand: kind, values and whose."""
        check, question = self._check, self._check.question
        arrays = self._arrays = self._reader.read([y[: len(names)] for names in self._columns])[0]
        assert question.body_wrench is not None
        joints = check.joints(self.wrong, arrays.wrenches, question.body_wrench)
        self.idle = check.idle(joints)
        residuals, again, _ = check.recompute(self.wrong, arrays, joints)
        named = np.array([y * (np.arange(len(y)) < len(names)) for names in self._columns])
        off = [r.values for r in residuals if r.kind == "zero" and not r.affine]
        off.append(self.loads_of(arrays) - named)
        near = np.abs(np.concatenate(off, axis=None)).max() <= self._negligible
        if not near or any(check_contacts(check.settled.names, arrays)):
            self.wrong.append("what loads do to the hands")
        each = np.arange(len(self._columns))
        return [
            ("load", again.loads, check.known.places.hand),
            ("palm", arrays.palms, each),
            ("wrench", arrays.wrenches, each),
            *(
                (r.kind, r.values, r.hand)
                if r.error is None
                else ("error", r.values / r.error, r.hand)
                for r in residuals
                if r.affine
            ),
        ]

    def _matters(self, kind: str, rows: Array) -> NDArray[np.bool_]:
        """Return for which rows (n, 1 + m) of numbers there may be loads that they refuse."""
        if kind in ("load", "palm", "wrench"):
            return np.ones(len(rows), dtype=bool)
        changing = np.abs(rows[:, 1:]).max(axis=1, initial=0.0) > self._negligible
        at_zero = {"zero": np.abs(rows[:, 0]), "use": rows[:, 0]}.get(kind, -rows[:, 0])
        return np.asarray(changing | ~(at_zero <= self._negligible))

    def loads_of(self, arrays: PlanArrays) -> Array:
        """Return the loads y in a plan's numbers, padded with zeros, shape (hands, m) [N]."""
        places = self._check.known.places
        first, ends = places.first_of_finger, [*places.first_of_finger[1:], len(arrays.loads)]
        kinds = {
            "tension": arrays.tensions,
            "lateral": np.add.reduceat(arrays.loads[:, 2], first),
            NAIL: arrays.loads[np.array(ends) - 1, 0],
        }
        found = np.zeros((len(self._columns), self._size))
        for h, (row, names, palm) in enumerate(
            zip(found, self._columns, arrays.palms, strict=True)
        ):
            by_name = {PALM_SHEAR: -palm[0], PALM_PRESSING: palm[2]}
            for kind, values in kinds.items():
                own = values[len(FINGERS) * h :]
                by_name |= {f"{name}/{kind}": own[i] for i, name in enumerate(FINGERS)}
            row[: len(names)] = [by_name[name] for name in names]
        return found

    def fault(
        self, loads: Array, wrenches: Array, utilisation: float, body_wrench: Array
    ) -> str | None:
        """Check a plan's numbers; return the first error, or None if the plan passes.

        Parameters
        ----------
        loads : ndarray, shape (hands, m)
            Loads y of each hand, padded with zeros [N].
        wrenches : ndarray, shape (hands, 6)
            Wrench of each hand on the rock, in its H [N, N·m].
        utilisation : float
            Utilisation of the whole stance, limbs without a hand included.
        body_wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        if self.wrong:
            return self.wrong[0]
        found, of = self._matrix @ loads.ravel() + self._constant, self._of
        own = found[of["wrench"]].reshape(-1, 6)
        carried = np.abs(found[: of["palm"].stop])
        allowed = TOLERANCES.load * max(1.0, float(most(carried)))
        again = max(float(most(found[of["use"]], initial=0.0)), self.idle)
        # each in terms that are false where a number is not finite
        for words in self._check.unbalanced(own, body_wrench):
            return words
        if not float(most(np.abs(own - wrenches), axis=None)) <= allowed:
            return "a hand's wrench"
        if not ((found[of["least"]] >= -allowed).all() and (found[of["error"]] >= -1.0).all()):
            return "a load of the wrong sign"
        if not abs(again - utilisation) <= TOLERANCES.utilisation * max(1.0, again):
            return "the utilisation"
        if not (np.abs(found[of["zero"]]) <= allowed).all():
            return "a load or a wrench that is given"
        tiles = found[of["load"]].reshape(-1, 3)
        for residual in self._check.recompute_curved(self._arrays, tiles, own):
            if not np.minimum.reduce(residual.values) >= -allowed:
                return next(residual.off(np.full(len(own), allowed)))
        return None
