"""Place hands by contact: where a closed hand, pulled and pushed by nothing, comes to rest on rock.

The tendons of a closed hand pull it into its rock, or push it off. At its *rest* the hand is in
equilibrium without a load: of its net wrench on the rock at the closing tension, in H,

    (f_z, m_x, m_y)(z, α, β) = 0

with z its way along z of the frame where it starts and (α, β, 0) the rotation vector of its turn
about that frame's origin. Its place along x and y and its turn about z stay: they are the wrist's.
Fingers are closed anew at every pose. Palm tiles press where rock stands in them, by their
stiffness and depth; they drag nothing, as nothing has moved along the rock.

The search starts where f_z passes from pulling to pushing along z, nearest the start of the hand.
The three equations are then solved by Broyden's method: damped Newton steps, whose derivatives are
computed again where steps do too little. Where they get caught between palm tiles that meet rock
and others, the palm's law is rounded first, and less and less. All hands take their steps together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import (
    Array,
    Indices,
    InvalidInputError,
    Pose,
    RefusedPlaceError,
    go_on,
    turns_about,
)
from hand_models.hand import FINGERS, Placement, Seating, SettledHand, SpinyHand
from hand_models.wrench_spaces import WRENCH_SCALE

__all__ = [
    "CONTACT_SETTINGS",
    "ContactSettings",
    "closed_wrench",
    "contact_slopes",
    "placed_by_contact",
    "rests_on_rock",
]


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Settings of the search for a hand's rest. A motion of 1 mm counts as a turn of 10 mrad."""

    force: float = 0.01
    """Largest net force at rest, and net moment over 0.1 m [N]: by some 40 N/mm along z it is a
    quarter of a micrometre, to which no rock is known."""
    difference: float = 1e-6
    """Half step of the finite differences along z [m]; turns take ten times as many radians."""
    longest: float = 1e-3
    """Longest step [m]: a contact moves over its tile by no more than a part of it."""
    steps: int = 25
    """Largest number of steps."""
    closings: int = 300
    """Closings of a hand after which its search ends: of the rests that are found, the farthest
    took 274."""
    patience: int = 8
    """Steps in which the net wrench must halve: where there is a rest, most take five in all."""
    shares: tuple[float, ...] = (1.0, 0.5, 0.2, 0.05, 0.01)
    """Shares of a step that are tried in turn until the net wrench falls."""
    border: float = 0.2
    """Share of a step that must stay where a hand may be: beyond, it creeps along the border."""
    roundings: tuple[float, ...] = (1e-4, 2e-5, 4e-6, 0.0)
    """Roundings of the palm's law, in turn, where steps get caught as its tiles meet rock [m]."""
    ways: tuple[float, ...] = tuple([1e-3 * k for k in range(-8, 6)])
    """Ways along z between which the net force is to pass from pulling to pushing [m]."""


CONTACT_SETTINGS: Final = ContactSettings()

MOVE_UNITS: Final = np.array([1e-3, 1e-2, 1e-2])
"""Units of (z, α, β) in the search [m, rad]: over 0.1 m, the turns move a contact by as much."""


def closed_wrench(settled: SettledHand, rounding: float = 0.0) -> Array:
    """Return the wrench on the rock of a hand that has closed and carries nothing.

    Every tendon has the closing tension; palm tiles press by the depth to which rock stands in
    them.

    Parameters
    ----------
    settled : SettledHand
    rounding : float, optional
        δ of a palm tile's law at depth d, in which ½ (d + √(d² + δ²)) stands for max(d, 0) [m].

    Returns
    -------
    ndarray, shape (6,)
        Force and moment about the origin of H, in H [N, N·m].
    """
    loads = settled.tile_loads(np.full(len(FINGERS), settled.closing_tension))
    forces = np.einsum("tk,tkx->tx", loads, settled.axes)
    moment = np.cross(settled.positions, forces).sum(axis=0)
    wrench = np.concatenate([forces.sum(axis=0), moment])
    engaged = list(settled.palm.engaged)
    if engaged:
        gaps, tiles = settled.palm.gaps[engaged], settled.hand.palm_tiles[engaged]
        pressing = np.array(settled.palm.engagement) * 0.5 * (np.hypot(gaps, rounding) - gaps)
        pressing *= settled.hand.palm_pressing_stiffness
        wrench[2:5] += pressing.sum(), pressing @ tiles[:, 1], -(pressing @ tiles[:, 0])
    return wrench


def placed_by_contact(
    hand: SpinyHand, settled: Sequence[SettledHand], offsets: Sequence[Pose] | None = None
) -> list[SettledHand | InvalidInputError]:
    """Close hands again where they come to rest on their rock, each moved by an offset from there.

    Parameters
    ----------
    hand : SpinyHand
        Model of all hands.
    settled : sequence of SettledHand, length n
        Hands where they start: their x, y and turn about z stay.
    offsets : sequence of Pose, length n, optional
        Wanted pose of each H in the frame of its rest; by default the hands stay at rest.

    Returns
    -------
    list of SettledHand or InvalidInputError
        The hands in order, of seating rule ``contact``; an error, of field ``placing``, for a hand
        that has no stable rest within `ContactSettings.ways` and ``seat_tilt`` of its start,
        or that cannot close at its offset.
    """
    offsets = [Pose.identity()] * len(settled) if offsets is None else offsets
    starts = [Placement(each.hold, each.surface, each.grasp, each.seating.pose) for each in settled]
    clings = InvalidInputError(
        "must be 'given' with grasp.fingernail: how a nail gives on its rock is not known",
        field="placing",
    )
    nails = [clings if each.grasp.fingernail else None for each in settled]
    able = [i for i, error in enumerate(nails) if error is None]
    found = dict(zip(able, rests_on_rock(hand, [starts[i] for i in able]), strict=True))
    outcomes: list[SettledHand | InvalidInputError] = []
    for i, error in enumerate(nails):
        rest = error or found[i]
        if isinstance(rest, InvalidInputError):
            outcomes.append(rest)
            continue
        slopes = contact_slopes(hand, _moved(starts[i], rest))
        finite = np.isfinite(slopes).all()
        stiffness = np.linalg.eigvalsh(0.5 * (slopes + slopes.T))[0] if finite else -np.inf
        if not stiffness > 0.0:
            outcomes.append(_unstable(float(stiffness)))
            continue
        (there,) = hand.settle_each([_moved(starts[i], rest @ offsets[i])])
        if isinstance(there, InvalidInputError):
            there.field = "contact_offset"
            outcomes.append(there)
            continue
        seating = Seating(there.seating.pose, "contact", offset=offsets[i])
        outcomes.append(replace(there, seating=seating))
    return outcomes


def contact_slopes(hand: SpinyHand, placement: Placement) -> Array:
    """Return the stiffness of a closed hand against z, roll and pitch, shape (3, 3) [N/m].

    Parameters
    ----------
    hand : SpinyHand
    placement : Placement
        Where the hand is, with ``hold_in_hand`` given.

    Returns
    -------
    ndarray, shape (3, 3)
        Derivative of f_z, m_x, m_y (`closed_wrench`) by the hand's motion along z of H and its
        turns about x and y, fingers closed anew; turns times 0.1 m, moments over 0.1 m.
    """
    search = _Search(hand, [placement])
    slopes = search.slopes(np.zeros((1, 3)), np.zeros(1, dtype=int))[0]
    return np.asarray(slopes / MOVE_UNITS[0])


def rests_on_rock(
    hand: SpinyHand, starts: Sequence[Placement], slopes: Array | None = None
) -> list[Pose | InvalidInputError]:
    """Return the pose in which each hand comes to rest on its rock, whether stable or not.

    Parameters
    ----------
    hand : SpinyHand
        Model of all hands.
    starts : sequence of Placement, length n
        Where the hands start, with ``hold_in_hand`` given.
    slopes : ndarray, shape (3, 3), optional
        First stiffness, that of a hand nearby (`contact_slopes`) [N/m]; computed by default.

    Returns
    -------
    list of Pose or InvalidInputError, length n
        In the order of ``starts``: H at rest in H at its start; an error, not raised, without rest.
    """
    search, found = _Search(hand, starts), dict[int, Pose]()

    def kept(which: Indices, ends: Array, rested: NDArray[np.bool_]) -> Indices:
        """Store where hands rest, and return the other hands."""
        for i, x in zip(which[rested].tolist(), ends[rested], strict=True):
            found[i] = _move(x)
        return which[~rested]

    left = np.arange(len(starts))
    if slopes is not None:
        left = kept(left, *search.solve(left, np.zeros((len(left), 3)), slopes * MOVE_UNITS[0]))
    left, begin = search.crossings(left)
    ends, rested = search.solve(left, begin)
    caught = ~rested & search.kinked_on_palm(left, ends)
    kept(left, ends, rested)
    left, ends = left[caught], begin[caught]
    for rounding in CONTACT_SETTINGS.roundings:
        search.rounding = rounding
        ends, rested = search.solve(left, ends)
        left, ends = left[rested], ends[rested]
    kept(left, ends, np.ones(len(left), dtype=bool))
    return [found.get(i) or search.error(i) for i in range(len(starts))]


class _Search:
    """Search for the rests of hands of one model, which take their steps together."""

    def __init__(self, hand: SpinyHand, starts: Sequence[Placement]) -> None:
        self._hand, self._starts, self.rounding = hand, starts, 0.0
        ends, tilt = np.array(CONTACT_SETTINGS.ways)[[0, -1]], hand.seat_tilt
        self._least = np.array([ends[0], -tilt, -tilt]) / MOVE_UNITS
        self._most = np.array([ends[1], tilt, tilt]) / MOVE_UNITS
        self._closed = np.zeros(len(starts), dtype=bool)
        self._kinked = np.zeros(len(starts), dtype=bool)
        """Whether a step was too long although it stayed where the hand may be."""
        self._refused: dict[int, InvalidInputError] = {}
        self._closings = np.zeros(len(starts), dtype=int)

    def wrenches(self, x: Array, which: Indices) -> Array:
        """Return (f_z, m_x, m_y) of hands at moves x, (m, 3) [N, moments over 0.1 m].

        Infinite where a hand cannot close, or is farther from its start than it may be.
        """
        found = np.full(x.shape, np.inf)
        within = np.flatnonzero(((self._least <= x) & (x <= self._most)).all(axis=1))
        moves = [_moved(self._starts[which[k]], _move(x[k])) for k in within]
        outcomes = self._hand.settle_each(moves)
        np.add.at(self._closings, which[within], 1)
        for k, outcome in zip(within, outcomes, strict=True):
            if isinstance(outcome, SettledHand):
                wrench = closed_wrench(outcome, self.rounding)
                found[k] = (wrench * WRENCH_SCALE)[2:5]  # f_z, m_x and m_y
                self._closed[which[k]] = True
            else:
                self._refused.setdefault(int(which[k]), outcome)
        return found

    def kinked_on_palm(self, which: Indices, x: Array) -> NDArray[np.bool_]:
        """Return which hands may be caught at moves x by palm tiles that just meet rock."""
        there = self._hand.settle_each(
            [_moved(self._starts[i], _move(at)) for i, at in zip(which, x, strict=True)]
        )
        least = [
            each.palm.nearest_gap if isinstance(each, SettledHand) else np.inf for each in there
        ]
        near = np.array(least) < max(CONTACT_SETTINGS.roundings)
        return near & self._kinked[which]

    def slopes(self, x: Array, which: Indices) -> Array:
        """Return the derivatives of the wrenches at m moves, (m, 3, 3), by central differences."""
        step = CONTACT_SETTINGS.difference / MOVE_UNITS[0]
        steps = step * np.vstack([np.eye(3), -np.eye(3)])
        near = (x[:, None] + steps).reshape(-1, 3)
        found = self.wrenches(near, np.repeat(which, len(steps))).reshape(-1, 2, 3, 3)
        with np.errstate(invalid="ignore"):
            slopes = (found[:, 0] - found[:, 1]) / (2.0 * step)
        return np.asarray(slopes.swapaxes(1, 2))

    def crossings(self, which: Indices) -> tuple[Indices, Array]:
        """Return hands whose net force passes from pulling to pushing along z, and moves to there.

        Of several such moves, shape (m, 3), the nearest of each hand; other hands are left out.
        """
        ways = np.array(CONTACT_SETTINGS.ways)
        x = np.zeros((len(which), len(ways), 3))
        x[..., 0] = ways / MOVE_UNITS[0]
        forces = self.wrenches(x.reshape(-1, 3), np.repeat(which, len(ways)))[:, 0]
        forces = forces.reshape(len(which), len(ways))
        low, high = forces[:, :-1], forces[:, 1:]
        with np.errstate(invalid="ignore"):
            at = ways[:-1] - low * np.diff(ways) / (high - low)
        crossed = (low < 0.0) & (high >= 0.0) & np.isfinite(high)
        at = np.where(crossed, at, np.inf)
        nearest = np.abs(at).argmin(axis=1)
        found = np.take_along_axis(at, nearest[:, None], axis=1)[:, 0]
        some = np.isfinite(found)
        return which[some], np.outer(found[some], [1.0, 0.0, 0.0]) / MOVE_UNITS

    def solve(
        self, which: Indices, begin: Array, slopes: Array | None = None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return moves (m, 3) to which steps lead, and whether the hands rest there.

        ``which``: indices of the hands; ``begin``: moves (m, 3) where steps begin; ``slopes``:
        derivatives to begin with.
        """
        settings, count, x = CONTACT_SETTINGS, len(which), begin.copy()
        left = self.wrenches(x, which)
        known = np.tile(np.eye(3) if slopes is None else slopes, (count, 1, 1))
        # of derivatives: not computed yet, or where steps have done too little
        stale, fresh = np.full(count, slopes is None), np.zeros(count, dtype=bool)
        going = np.isfinite(left).all(axis=1)
        mark = np.full(count, np.inf)
        for number in range(settings.steps):
            size = np.abs(left).max(axis=1)
            going &= (size > settings.force) & (self._closings[which] < settings.closings)
            if number % settings.patience == 0:
                going &= size < 0.5 * mark
                mark = size
            if not going.any():
                break
            go_on()
            anew = np.flatnonzero(going & stale)
            if len(anew):
                known[anew] = self.slopes(x[anew], which[anew])
            fresh, stale = stale.copy(), np.zeros(count, dtype=bool)
            going &= np.isfinite(known).all(axis=(1, 2))
            active = np.flatnonzero(going)
            steps = np.zeros_like(x)
            for i in active:
                steps[i] = np.linalg.lstsq(known[i], -left[i])[0]
            longest = np.abs(steps).max(axis=1, initial=1e-30) * MOVE_UNITS[0]
            steps *= np.minimum(1.0, settings.longest / longest)[:, None]
            was, beyond = np.linalg.norm(left, axis=1), active[:0]
            for share in settings.shares:
                if not len(active):
                    break
                there = self.wrenches(x[active] + share * steps[active], which[active])
                better = np.linalg.norm(there, axis=1) < was[active]
                for i, wrench in zip(active[better], there[better], strict=True):
                    step = share * steps[i]
                    miss = wrench - left[i] - known[i] @ step
                    known[i] += np.outer(miss, step) / (step @ step)
                    x[i], left[i] = x[i] + step, wrench
                    stale[i] = np.linalg.norm(wrench) > 0.5 * was[i]
                known_there = np.isfinite(there).all(axis=1)
                self._kinked[which[active[~better & known_there]]] = True
                out = ~known_there & (share <= settings.border)
                beyond, active = np.append(beyond, active[out]), active[~better & ~out]
            active = np.append(active, beyond)
            self._kinked[which[beyond]] = False
            # steps along derivatives computed here lead nowhere
            going[active[fresh[active]]] = False
            stale[active] = True
        return x, np.abs(left).max(axis=1) <= settings.force

    def error(self, i: int) -> InvalidInputError:
        """Return why a hand has no rest."""
        if not self._closed[i]:
            return self._refused[i]
        grasp = self._starts[i].grasp
        tension = grasp.closing_tension or self._hand.closing_tension
        off, deeper = np.abs(np.array(CONTACT_SETTINGS.ways)[[0, -1]]) * 1e3
        return RefusedPlaceError(
            f"a hand closed at {tension:g} N comes to rest nowhere from {off:g} mm off its pose to "
            f"{deeper:g} mm deeper, tilted by at most {1e3 * self._hand.seat_tilt:.3g} mrad: its "
            "net force along z and its moments about x and y are nowhere zero together, as on flat "
            "rock where no fingers oppose each other; use 'given', or give another pose, "
            "grasp.outer_rotation or grasp.closing_tension",
            reason="no_rest",
            field="placing",
        )


def _move(x: Array) -> Pose:
    """Return the frame of a hand that has moved by x in `MOVE_UNITS`, in that of its start."""
    z, roll, pitch = (x * MOVE_UNITS).tolist()
    return Pose(np.array([0.0, 0.0, z]), turns_about([roll, pitch, 0.0]))


def _moved(start: Placement, move: Pose) -> Placement:
    """Return the placement of a hand that has moved from its start."""
    assert start.hold_in_hand is not None
    return start._replace(hold_in_hand=move.inverse() @ start.hold_in_hand)


def _unstable(stiffness: float) -> InvalidInputError:
    return RefusedPlaceError(
        f"the closed hand does not stay where its net force is zero (its least stiffness there is "
        f"{stiffness:.3g} N/m): use 'given', or another grasp or place",
        reason="unstable_rest",
        field="placing",
    )
