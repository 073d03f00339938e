"""Stick and slip of the tendon in one finger (Section 5.2, Appendix 9.3).

The tendon runs from the motor, tension f = t_0, through phalanges i = 1 … n; its tension t_i is
constant within a phalanx. It passes the boundary before phalanx i by v_i, positive toward the
motor, and v_{n+1} = 0 at its end. On closing it runs toward the motor, and friction leaves
t_i = M_i f with M = diag(1, 1 − μ, (1 − μ)², …) (Eq. 8).

When the load changes, phalanx i moves by δx_i along the rock, positive toward the finger's base,
its joint turns by δq_i, and its tile by δd_i toward the base relative to the phalanx:

    c_p δd_i + r_i δq_i = v_i − v_{i+1}            (length of the tendon in phalanx i)
    δT_i = k_i (δx_i + δd_i)                       (shear on the rock, Eq. 20)
    c_p δt_i = δT_i + K_p δd_i                     (balance of the tile, Eq. 5)
    v_i > 0 ⇒ t_i = (1 − μ_i) t_{i−1},   v_i < 0 ⇒ t_i = (1 + μ_i) t_{i−1},
    v_i = 0 ⇒ between the two                      (the bounds 1 ± μ of Section 5.2),

with c_p strands at each tile's pulley, pulley radii r_i, contact stiffnesses k_i, tile springs K_p
and friction μ_i. Where nothing slips, δd_i = −r_i δq_i / c_p is the δl of Eq. 20. Either the
motor's tension f is given, or the motor is held: v_1 = 0, or the tendon goes slack (f = 0,
v_1 > 0).

There is one solution. Take two, and their differences Δ: where Δv_i > 0, Δt_i is at most
(1 − μ_i) Δt_{i−1} or (1 + μ_i) Δt_{i−1}, so Δt_{i−1} ≤ 0 brings Δt_i ≤ 0; and
Δv_{i+1} = Δv_i − c_p² Δt_i / (k_i + K_p). From Δt_0 = 0, Δv_1 > 0 would make every further Δv at
least as large, but Δv_{n+1} = 0. So Δv_1 = 0; then Δt_1 = 0 in the same way, and so on down the
finger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, InvalidInputError
from hand_models.parameters import ParameterTable
from hand_models.tendon.complementarity import stick_slips

__all__ = ["FingerTendon", "TendonBatch", "TendonState", "pad_tiles"]

LEAST_FRICTION = 10.0 * BASE_TOLERANCES.relative
"""Largest coefficient of friction that counts as none: such a boundary never sticks."""


@dataclass(frozen=True, eq=False)
class TendonState:
    """Tensions of a finger's tendon and shears of its tiles.

    Attributes
    ----------
    motor_tension : float
        f, tension at the motor [N].
    tensions, shears : ndarray, shape (n,)
        t_i in each phalanx, and T_i of each tile on the rock [N].
    """

    motor_tension: float
    tensions: Array
    shears: Array


@dataclass(frozen=True)
class FingerTendon:
    """Pulleys, springs and friction of a finger's tendon, phalanx by phalanx from the base.

    Attributes
    ----------
    pulley_ratio : float
        c_p, strands of tendon at each tile's pulley.
    contact_stiffness : tuple of float, length n
        k_i of each tile on the rock, 0 for a tile off the rock [N/m].
    spring_stiffness : float
        K_p of each tile's springs [N/m].
    pulley_radii : tuple of float, length n
        r_i of each joint, 0 for a tile on the finger's base [m].
    friction : float
        μ between adjacent phalanges, in [0, 1).
    entry_friction : float
        μ_1 between the motor and the first phalanx. Eq. 8 has no loss there, Section 5.2 bounds
        the first element of M by 1 ± μ like the others. It matters only where f is given: a held
        motor keeps v_1 = 0 with any friction.

    Raises
    ------
    InvalidInputError
        If a number is out of range, or the two tuples differ in length.
    """

    pulley_ratio: float
    contact_stiffness: tuple[float, ...]
    spring_stiffness: float
    pulley_radii: tuple[float, ...]
    friction: float
    entry_friction: float = 0.0

    @classmethod
    def from_table(
        cls, table: ParameterTable, base_tile: bool = False, stiffness_ratio: float = 1.0
    ) -> FingerTendon:
        """Return the tendon with the numbers of a ``hand.toml`` table, all its tiles on the rock.

        Parameters
        ----------
        table : ParameterTable
        base_tile : bool, optional
            Whether a tile on the finger's base comes first.
        stiffness_ratio : float, optional
            Contact stiffness over that of the table.
        """
        radii = table.vector("finger", "pulley_radii")
        stiffness = tuple(stiffness_ratio * k for k in table.vector("tile", "contact_stiffness"))
        if base_tile:
            radii, stiffness = (0.0, *radii), (stiffness[0], *stiffness)
        return cls(
            pulley_ratio=table.scalar("tile", "pulley_ratio"),
            contact_stiffness=stiffness,
            spring_stiffness=table.scalar("tile", "spring_stiffness"),
            pulley_radii=radii,
            friction=table.scalar("tendon", "friction"),
            entry_friction=table.scalar("tendon", "entry_friction"),
        )

    def engaged(self, shares: Sequence[float] | Array) -> FingerTendon:
        """Return the tendon for tiles with only a share of their spines on the rock.

        A tile gives φ times the shear of a whole one, for tendon and slip alike: k_i becomes what
        in series with K_p is φ times as stiff, φ k K_p / (K_p + (1 − φ) k).

        Parameters
        ----------
        shares : sequence of float, length n
            Spine engagement φ of each tile.
        """
        k, phi = np.array(self.contact_stiffness), self._of_phalanges("shares", shares)
        springs = self.spring_stiffness + (1.0 - phi) * k
        some = phi * k * self.spring_stiffness / np.where(phi < 1.0, springs, 1.0)
        return replace(self, contact_stiffness=tuple(np.where(phi < 1.0, some, k).tolist()))

    def __post_init__(self) -> None:
        _check("pulley_ratio", self.pulley_ratio, 0.0 < self.pulley_ratio < np.inf, "above 0")
        stiffness, springs = self.contact_stiffness, self.spring_stiffness
        _check("spring_stiffness", springs, 0.0 <= springs < np.inf, "not negative [N/m]")
        held = all(0.0 <= k < np.inf and k + springs > 0.0 for k in stiffness)
        _check("contact_stiffness", stiffness, held, "not negative, and above 0 without springs")
        same = 0 < len(stiffness) == len(self.pulley_radii)
        _check("pulley_radii", self.pulley_radii, same, "one for each contact stiffness")
        for name in ("friction", "entry_friction"):
            mu = getattr(self, name)
            _check(name, mu, 0.0 <= mu < 1.0, "in [0, 1)")

    def closed(self, tension: float, shears: Sequence[float] | Array) -> TendonState:
        """Return the state of tendon and tiles at closing, with the tensions of Eq. 8.

        Parameters
        ----------
        tension : float
            f at which the finger closed [N].
        shears : sequence of float, length n
            Shear of each tile on the rock at closing [N].
        """
        _check("tension", tension, 0.0 <= tension < np.inf, "finite and not negative [N]")
        n = len(self.pulley_radii)
        losses = (1.0 - self.friction) ** np.arange(n, dtype=float)
        return TendonState(
            motor_tension=float(tension),
            tensions=np.asarray(tension * losses),
            shears=self._of_phalanges("shears", shears),
        )

    def held(
        self,
        state: TendonState,
        shift: Sequence[float] | Array | None = None,
        turn: Sequence[float] | Array | None = None,
    ) -> TendonState:
        """Return the state after a change of load with the motor standing still.

        The tendon gives no length past the first boundary, whatever its friction; the motor's
        strand keeps its tension as far as that friction can balance the difference. Exact for a
        step at whose end every boundary that slipped on the way still slips.

        Parameters
        ----------
        state : TendonState
            Tendon and tiles at rest, the tendon not slack.
        shift, turn : sequence of float, length n, optional
            δx_i, displacement of each phalanx along the rock toward the finger's base [m]; δq_i,
            turn of each joint, closing [rad]. Zero by default.

        Raises
        ------
        InvalidInputError
            If a number is not finite or missing.
        SolverError
            If rounding errors keep the solution from being found.
        """
        after, shears = self._changed(state, shift, turn, None)
        first, mu = float(after[0]), self.entry_friction
        motor = min(max(state.motor_tension, first / (1.0 + mu)), first / (1.0 - mu))
        return TendonState(motor, after, shears)

    def kept(
        self,
        state: TendonState,
        shift: Sequence[float] | Array | None = None,
        turn: Sequence[float] | Array | None = None,
    ) -> TendonState:
        """Return the state after a change of load while the motor keeps its tension.

        Parameters
        ----------
        state : TendonState
            Tendon and tiles at rest.
        shift, turn : sequence of float, length n, optional
            δx_i, displacement of each phalanx along the rock toward the finger's base [m]; δq_i,
            turn of each joint, closing [rad]. Zero by default.

        Raises
        ------
        InvalidInputError
            If a number is not finite or missing.
        SolverError
            If rounding errors keep the solution from being found.
        """
        after, shears = self._changed(state, shift, turn, state.motor_tension)
        return TendonState(state.motor_tension, after, shears)

    def slipped(
        self, state: TendonState, tile: int, shear: float, motor: float | None
    ) -> TendonState:
        """Return the state after a tile has let go of the rock, on which it drags on.

        All phalanges stay where they are. The tile's shear is given, and its springs alone balance
        the tendon.

        Parameters
        ----------
        state : TendonState
            At rest, not slack.
        tile : int
            Index of the tile.
        shear : float
            Its shear on the rock from then on [N].
        motor : float or None
            Tension that the motor keeps [N]; None if the motor stands still.
        """
        k, pushed = list(self.contact_stiffness), np.zeros(len(self.pulley_radii))
        k[tile], pushed[tile] = 0.0, shear - state.shears[tile]
        free = replace(self, contact_stiffness=tuple(k))
        after, shears = free._changed(state, None, None, motor, pushed)
        return TendonState(float(after[0]) if motor is None else motor, after, shears)

    def drawn(self, before: TendonState, after: TendonState) -> float:
        """Return the length of tendon that tiles give to the motor from one state to another [m].

        The joints do not turn: c_p Σ δd_i, by the balance of each tile.
        """
        tensions, shears = after.tensions - before.tensions, after.shears - before.shears
        moved = (self.pulley_ratio * tensions - shears) / self.spring_stiffness
        return float(self.pulley_ratio * moved.sum())

    def _changed(
        self,
        state: TendonState,
        shift: Sequence[float] | Array | None,
        turn: Sequence[float] | Array | None,
        motor: float | None,
        given: Array | None = None,
    ) -> tuple[Array, Array]:
        """Return tensions and shears after a change of load, at a motor's tension or held.

        ``given``: changes of shears besides those by the shift, shape (n,) [N].
        """
        own = self._of_phalanges
        shift, turn, tensions = own("shift", shift), own("turn", turn), state.tensions
        pushed = np.zeros(len(shift)) if given is None else given
        rest = np.array([state.motor_tension]), tensions[None], state.shears[None]
        batch = TendonBatch((self,), (motor is not None,))
        after, shears = batch.changed(rest, shift[None], turn[None], pushed[None])
        return after[0], shears[0]

    def _of_phalanges(self, field: str, values: Sequence[float] | Array | None) -> Array:
        n = len(self.pulley_radii)
        if values is None:
            return np.zeros(n)
        given = np.array(values, dtype=float)
        valid = given.shape == (n,) and bool(np.isfinite(given).all())
        _check(field, values, valid, f"{n} finite numbers")
        return given


def _check(field: str, value: object, valid: bool, needed: str) -> None:
    if not valid:
        raise InvalidInputError(f"must be {needed}, got {value}", field=field)


class TendonBatch:
    """The tendons of F fingers, whose stick and slip is solved at once.

    Tendons over fewer tiles than others are padded at their ends with tiles that do not move.

    Parameters
    ----------
    tendons : sequence of FingerTendon, length F
    driven : sequence of bool, length F
        Whether the motor keeps its tension, or stands still.
    """

    def __init__(self, tendons: Sequence[FingerTendon], driven: Sequence[bool]) -> None:
        own = pad_tiles([np.ones(len(each.pulley_radii)) for each in tendons])
        self._stiffness = k = pad_tiles([each.contact_stiffness for each in tendons])
        self._radii = pad_tiles([each.pulley_radii for each in tendons])
        self._ratio = c = np.array([[each.pulley_ratio] for each in tendons])
        springs = np.array([[each.spring_stiffness] for each in tendons])
        # how far a tile travels per newton, and a phalanx's share of tendon then [m/N]
        self._give = give = own / (k + np.where(own > 0.0, springs, 1.0))
        unit = c**2 * (give.sum(axis=1) / own.sum(axis=1))[:, None]
        self._driven = np.array(driven)
        mu = own * [[each.friction] for each in tendons]
        entries = np.array([each.entry_friction for each in tendons])
        mu[:, 0] = np.where(self._driven, entries, 0.0)
        n = own.shape[1]
        # t_i = (1 − μ_i) t_{i−1} + 2 μ_i a_i by t_0 and the a of boundaries that have friction
        rows = [np.eye(n + 1)[0] * np.ones((len(own), 1))]
        for i in range(n):
            loss = mu[:, i, None]
            rows.append((1.0 - loss) * rows[-1] + 2.0 * loss * np.eye(n + 1)[i + 1])
        tensions = np.stack(rows, axis=1)
        self._before, self._after = tensions[:, :-1], tensions[:, 1:]
        # v, what the phalanges from each boundary on give, in newtons; t_0 is unknown where the
        # motor is held: its boundary moves only where it is slack
        self._passed = np.triu(np.ones((n, n)))[[0, *range(n)]] / unit[..., None]
        self._travel = self._passed @ ((c**2 * give)[..., None] * self._after)
        self._known = np.where(mu > LEAST_FRICTION, np.nan, 0.0)

    def changed(
        self, state: tuple[Array, Array, Array], shift: Array, turn: Array, given: Array | float
    ) -> tuple[Array, Array]:
        """Return tensions and shears after a change of load, shapes (F, n) [N].

        Parameters
        ----------
        state : tuple of ndarray, shapes (F,), (F, n), (F, n)
            Tensions at the motor and in each phalanx, and shears of the tiles at rest [N].
        shift, turn : ndarray, shape (F, n)
            δx_i, displacement of each phalanx along the rock toward the finger's base [m]; δq_i,
            turn of each joint, closing [rad].
        given : ndarray, shape (F, n), or float
            Changes of shears besides those by the shift [N].

        Raises
        ------
        SolverError
            If rounding errors keep the solution from being found.
        """
        (motor, tensions, shears), c, k, give = state, self._ratio, self._stiffness, self._give
        pushed = k * shift + given
        free = self._radii * turn - c * give * (c * tensions + pushed)
        known = np.column_stack((np.where(self._driven, motor, np.nan), self._known))
        found = stick_slips(
            (self._travel, (self._passed @ free[..., None])[..., 0]),
            (self._before, np.zeros(shift.shape)),
            known,
        )
        after = (self._after @ found[..., None])[..., 0]
        travel = give * (c * (after - tensions) - pushed)
        return after, shears + pushed + k * travel


def pad_tiles(rows: Sequence[Sequence[float] | Array]) -> Array:
    """Return numbers of tiles as one array (F, n), rows with fewer than n tiles ending in zeros.

    Parameters
    ----------
    rows : sequence of sequence of float, length F
        One number for each tile of each finger.
    """
    count = max(map(len, rows))
    return np.array([[*row, *[0.0] * (count - len(row))] for row in rows], dtype=float)
