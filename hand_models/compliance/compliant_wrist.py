"""Wrench space of a hand with driven tendons and a compliant wrist.

The hand has closed at the tensions f of its tendons; then its wrist moves by a twist ξ, and each
motor keeps its tension. The loads are affine in f at a given ξ and curved in ξ, so that the set
linearised about y = (f, ξ) is exact there, and a good approximation within about 1 mm and 20 N.

Each palm tile presses by its travel past its gap to the rock, and drags by the wrist's travel
toward −x. Both springs set in with the smooth law ½ k (d + √(d² + δ²)) (stiffness k, travel d,
rounding δ), so that a search finds their gradient before contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array
from hand_models.compliance.compliant_hand import CompliantHand, CompliantHands, HandLoads
from hand_models.compliance.floating_wrist import PALM_MODES, WRIST_COLUMNS, FloatingWrist, PalmMode
from hand_models.compliance.grasp import LoadRows, complex_steps, rows_of_range
from hand_models.compliance.rolling import Numbers
from hand_models.hand import FINGERS, SettledHand, WristTravel
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = ["CompliantWrist", "CompliantWrists", "DrivenHand"]

TENDONS: Final = tuple(f"{finger}/tension" for finger in FINGERS)
"""Columns of a driven hand's set for its tendon tensions f [N]."""


class DrivenHand(CompliantHand):
    """A settled hand whose motors keep their tensions while its wrist moves.

    Parameters
    ----------
    settled : SettledHand
        Not in a fingernail grasp.
    """

    def __init__(self, settled: SettledHand) -> None:
        super().__init__(settled, scheme="tension")
        palm = settled.palm
        self._gaps = np.maximum(palm.gaps[list(palm.engaged)], 0.0)
        self._pressing = settled.hand.palm_pressing_stiffness * np.array(palm.engagement)

    def palm_loads(self, twists: Numbers) -> Numbers:
        travel = self.palm_travel(twists)
        if not self.settled.palm.engaged:
            return 0.0 * travel
        # 0.1 mm of shear and 0.02 mm of pressing over which the springs set in [m]
        shear = self.palm_stiffness[0] * _set_in(travel[:, 0], 1e-4)
        pressed = _set_in(travel[:, 1:] - self._gaps, 2e-5)
        return np.stack([shear, pressed @ self._pressing], axis=-1)


def _set_in(travel: Numbers, rounding: float) -> Numbers:
    """Return how far one-sided springs are compressed, rounded about no travel [m]."""
    return np.asarray(0.5 * (travel + np.sqrt(travel * travel + rounding * rounding)))


class CompliantWrist(FloatingWrist):
    """Limits and wrench space of a hand with driven tendons and a compliant wrist.

    A pose y of this grasp is (f, ξ): four tendon tensions [N], then the wrist's twist [m, rad].

    Parameters
    ----------
    hand : DrivenHand
    tension_limit : float, optional
        A caller's cap on every tendon [N].
    travel : WristTravel, optional
        Range of the wrist's twist; the default range if left out.
    """

    columns = (*TENDONS, *WRIST_COLUMNS)
    range_rows = rows_of_range(columns)
    driven = True

    def __init__(
        self,
        hand: DrivenHand,
        tension_limit: float | None = None,
        travel: WristTravel | None = None,
    ) -> None:
        self.travel = WristTravel() if travel is None else travel
        # hard rows in newtons: a millimetre counts as 100 N, ten milliradians as much
        scale, (least, most) = np.array([1e5] * 3 + [1e4] * 3), self.travel.bounds
        sides = np.hstack([np.zeros((len(scale), len(TENDONS))), np.diag(scale)])
        room = np.concatenate([scale * most, scale * np.negative(least)])
        self._travel = np.vstack([sides, -sides]), room
        self.palm_carries = bool(hand.settled.palm.engaged)
        super().__init__(hand, tension_limit)

    @property
    def at_rest(self) -> Array:
        return np.concatenate([self.hand.preload, np.zeros(len(WRIST_COLUMNS))])

    def _load_rows(self) -> LoadRows:
        rows = super()._load_rows()
        # no row says which way the palm goes: its law is the same either way
        kept = [row for row in rows.names if not row.limit.endswith("_reversed")]
        travel = [
            Row(None, None, "wrist_travel", "hard", f"wrist_travel/{name.split('/')[1]}{sign}")
            for sign in "+-"
            for name in WRIST_COLUMNS
        ]
        return rows._replace(names=(*kept, *travel))

    def palm_modes(self) -> tuple[PalmMode, ...]:
        return ("off",)

    def palm_mode(self, y: Array, given: PalmMode) -> PalmMode:
        shear, inward = self.hand.palm_travel(y[None, len(TENDONS) :])[0].tolist()
        gap = self.hand.settled.palm.gaps[list(self.hand.settled.palm.engaged)].min(initial=np.inf)
        return PALM_MODES[self.palm_carries and shear > 0.0, self.palm_carries and inward > gap]

    def without_palm(self) -> CompliantWrist:
        """Return a copy whose palm carries no load; both share one cache of loads."""
        idle = copy(self)
        idle.palm_carries = False
        return idle

    def closed_at(self, y: Array) -> Array:
        return y[: len(TENDONS)]

    def hand_loads(self, y: Numbers) -> HandLoads:
        return self.hand.loads(y[:, len(TENDONS) :], y[:, : len(TENDONS)])

    def linearised_each(
        self, twists: Array, palm: PalmMode | None = None, within: ArrayLike | None = None
    ) -> list[WrenchSpace]:
        carried = [
            loads if self.palm_carries else loads._replace(palm=0.0 * loads.palm)
            for loads in self._stepped(twists)
        ]
        return [
            self._about(at, self._grasp_loads(loads), *self._travel, within)
            for at, loads in zip(twists, carried, strict=True)
        ]


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
