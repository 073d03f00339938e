"""Wrench space of a hand with driven tendons and a compliant wrist.

The hand has closed at the tensions f of its tendons; then its wrist moves by a twist ξ, and each
motor keeps its tension. At a given ξ the loads are affine in f, in pieces between which a tendon
begins to slip or to stick; in ξ they are curved. So the set linearised about y = (f, ξ) is exact
there, and a good approximation within about 1 mm and 20 N.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.compliance.compliant_hand import CompliantHand, CompliantHands, HandLoads
from hand_models.compliance.floating_wrist import WRIST_COLUMNS, FloatingWrist
from hand_models.compliance.grasp import LoadRows, complex_steps, rows_of_range
from hand_models.compliance.link import Numbers
from hand_models.hand import FINGERS, WristTravel
from hand_models.wrench_spaces import Row

__all__ = ["CompliantWrist", "CompliantWrists"]

TENDONS: Final = tuple(f"{finger}/tension" for finger in FINGERS)
"""Columns of a driven hand's set for its tendon tensions f [N]."""


class CompliantWrist(FloatingWrist):
    """Limits and wrench space of a hand with driven tendons and a compliant wrist.

    A pose y of this grasp is (f, ξ): four tendon tensions [N], then the wrist's twist [m, rad].

    Parameters
    ----------
    hand : CompliantHand
        Its motors keep their tensions (scheme ``tension``).
    tension_limit : float, optional
        Cap on every tendon's tension; the hand's maximum if that is less [N].
    travel : WristTravel, optional
        Range of the wrist's twist; the default `WristTravel` if left out.
    """

    columns = (*TENDONS, *WRIST_COLUMNS)
    range_rows = rows_of_range(columns)
    driven = True

    def __init__(
        self,
        hand: CompliantHand,
        tension_limit: float | None = None,
        travel: WristTravel | None = None,
    ) -> None:
        self.travel = WristTravel() if travel is None else travel
        # hard rows in newtons: a millimetre counts as 100 N, ten milliradians as much
        scale, (least, most) = np.array([1e5] * 3 + [1e4] * 3), self.travel.bounds
        sides = np.hstack([np.zeros((len(scale), len(TENDONS))), np.diag(scale)])
        room = np.concatenate([scale * most, scale * np.negative(least)])
        self._travel = np.vstack([sides, -sides]), room
        super().__init__(hand, tension_limit)

    @property
    def at_rest(self) -> Array:
        return np.concatenate([self.hand.preload, np.zeros(len(WRIST_COLUMNS))])

    def _load_rows(self) -> LoadRows:
        rows = super()._load_rows()
        travel = [
            Row(None, None, "wrist_travel", "hard", f"wrist_travel/{name.split('/')[1]}{sign}")
            for sign in "+-"
            for name in WRIST_COLUMNS
        ]
        return rows._replace(names=(*rows.names, *travel))

    def closed_at(self, y: Array) -> Array:
        return y[: len(TENDONS)]

    def hand_loads(self, y: Numbers) -> HandLoads:
        return self.hand.loads(y[:, len(TENDONS) :], y[:, : len(TENDONS)])

    @property
    def travel_rows(self) -> tuple[Array, Array]:
        return self._travel


class CompliantWrists:
    """Compliant wrists of a stance, whose loads are computed in one call.

    Parameters
    ----------
    wrists : sequence of CompliantWrist
    """

    def __init__(self, wrists: Sequence[CompliantWrist]) -> None:
        self.wrists = wrists
        self._hands = CompliantHands([wrist.hand for wrist in wrists])

    def prepare(self, poses: Sequence[Array]) -> None:
        """Compute and cache the loads that `CompliantWrist.linearised_each` needs at given poses.

        Parameters
        ----------
        poses : sequence of ndarray, shape (k, 10)
            Poses (f, ξ) for each wrist [N, m, rad].
        """
        if all(map(CompliantWrist.knows, self.wrists, poses)):
            return
        steps = [np.concatenate([complex_steps(at) for at in own]) for own in poses]
        count = len(TENDONS)
        twists, tensions = [y[:, count:] for y in steps], [y[:, :count] for y in steps]
        found = self._hands.loads(twists, tensions)
        for wrist, own, loads in zip(self.wrists, poses, found, strict=True):
            wrist.keep(own, loads)
