"""The balance of joints and tendons with forces on the rock (Eqs. 4–8), for the check of plans.

A plan's numbers are put into the balance. About joint i, with angle q_i to the phalanx before it,
the forces F_j on the rock of the joint's own phalanx and those beyond balance the tendon's torque
minus that of the joint's spring,

    Σ_{j ≥ i} (p_j − p_i) × F_j = M_i r_i f − k_i q_i − τ_i,

and a tile carries the shear φ_t M_t (g f + (e_t − g) f_c). Here p are positions, f is the tension,
M_i the share of the tension that is left at joint i or tile t, r_i the pulley radius, k_i and τ_i
stiffness and preload of the spring, g and e_t gains of shear, f_c the closing tension at which the
spines engaged, and φ_t the share of the spines that did.

Nothing is shared with the computation of the affine maps of settled hands (Eq. 14): the balance
itself is solved, once for hands at rest, whose loads are affine in the tensions. A tile that has
slipped has the shear μ N of friction, N its normal load. A contact of few spines across a gap bears
the share w of what balances its joint, and the joint, which is taken as locked, the rest
(`hand_models.finger.Contact`).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger import JOINT_STOPS
from planner.prepare import CONTACT_CODES
from planner.verification.finger_geometry import RestingFingers, moments_of
from planner.verification.residuals import (
    FINGER_COUNT,
    PartNames,
    Recomputed,
    Residual,
    ResidualLimits,
)

__all__ = ["Fingers", "JointBalance"]


STOP_SIGNS: Final = np.array(
    [{"upper": 1.0, "lower": -1.0}.get(str(stop), 0.0) for stop in JOINT_STOPS]
)
"""Signs of a joint's torque on the limit at which it stands."""


class Fingers(NamedTuple):
    """State of fingers on their holds, from which the normals of their tiles are solved.

    Attributes
    ----------
    shear : ndarray, shape (…, T)
        Shear of each tile [N].
    torques : ndarray, shape (…, F, 3)
        Tendon torque minus spring torque of each joint, positive if closing [N·m].
    joints : ndarray, shape (F, 3, 2)
        Position of each joint from the proximal one: along the straight finger, and into the rock
        [m].
    points : ndarray, shape (at least T, 3)
        Point of each tile in H [m].
    axes : ndarray, shape (T, 3, 3)
        Unit vectors of shear, normal and lateral load of each tile, in H.
    """

    shear: Array
    torques: Array
    joints: Array
    points: Array
    axes: Array


class JointBalance(ResidualLimits):
    """The balance of the fingers' joints, and the limits of their tendons and stops.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.
    floating : collection of int
        Indices of the hands with floating or compliant wrists, whose tendons may be slackened.
    before : JointBalance, optional
        The balance of the same hands before tiles slipped, whose geometry is taken over.

    Attributes
    ----------
    left : ndarray, shape (T,)
        Share of a tendon's tension that is left at each tile; of nails zero.
    held : ndarray of bool, shape (F, 3), or None
        True for joints that a stop, or tendon and springs alone, hold, and for all joints of a
        finger without contact; None if all tiles touch.
    stop_fingers, stop_joints : ndarray of int, shape (k,)
        Finger and joint of each joint at a stop, for fingers that touch rock.
    """

    def __init__(
        self,
        names: PartNames,
        floating: Collection[int] = (),
        before: JointBalance | None = None,
    ) -> None:
        known = names.known
        hands, places, touch = known.hands, known.places, known.touch
        self._names, self._known, body = names, known, hands[0].hand
        self._resting: RestingFingers
        self._resting = at_rest = RestingFingers.of(known) if before is None else before._resting
        self.left = at_rest.left
        # slipped tiles drag on with friction alone
        self._rubs = np.zeros(len(places.hand))
        self._rubs[touch.slipped] = known.friction[touch.slipped]
        self._rubs[places.bases] = 0.0  # which no joint presses
        self._closing = np.array(known.closing_tensions)
        self._shear = at_rest.engaged * known.engagement
        self._gain = at_rest.gain * known.engagement
        # friction holds the tendon of a finger that draws a tile or a nail along rock
        drawing = [
            i
            for i, holds in enumerate(touch.holding)
            if holds and body.finger.friction > 0.0 and i // FINGER_COUNT not in floating
        ]
        self._drawing = np.array(drawing, dtype=np.intp)
        self._hand_of_finger = np.arange(len(hands)).repeat(FINGER_COUNT)

        self.held: NDArray[np.bool_] | None = None
        self.stop_fingers = self.stop_joints = np.zeros(0, dtype=np.intp)
        self._sides = np.zeros(0)
        if len(touch.touching) < len(places.hand):
            self._bears = touch.contacts[places.phalanges] != CONTACT_CODES["none"]
            alone = ~self._bears.any(axis=1, keepdims=True)
            stops = known.stops
            self.held = (stops > 0) | alone
            sides = STOP_SIGNS[stops] * ~alone
            self.stop_fingers, self.stop_joints = sides.nonzero()
            self._sides = sides[self.stop_fingers, self.stop_joints]

        # fingers, joints and phalanges of contacts that bear with a locked joint
        self._few = self._shared_joints()

        # two tensions suffice, as shears, normals and balances are affine in them
        shear = np.stack((self._shear, self._shear + self._gain))
        torques = np.stack((at_rest.springs, at_rest.springs + at_rest.pull))
        try:
            normals, left = self._balanced(shear, torques, at_rest.moments)
        except np.linalg.LinAlgError:
            # nothing is what it should be, so that every plan is refused
            normals, left = np.full(shear.shape, np.nan), np.full(torques.shape, np.nan)
        both = np.stack((shear + self._rubs * normals, normals), axis=2)
        self._at_zero, self._per_newton = np.zeros((2, normals.shape[1], 3))
        self._at_zero[:, :2], self._per_newton[:, :2] = both[0], both[1] - both[0]
        self._left_at_zero, self._left_per_newton = left[0], left[1] - left[0]

    def _shared_joints(self) -> tuple[Indices, Indices, Indices]:
        """Return finger, joint and phalanx of each contact that bears with a locked joint."""
        shares = self._known.bearing_shares
        free = np.ones(shares.shape, dtype=bool) if self.held is None else ~self.held
        bears = free if self.held is None else self._bears
        # contacts and the joints that they support, both in their order
        (fingers, joints), (others, phalanges) = free.nonzero(), bears.nonzero()
        if not np.array_equal(fingers, others):
            few = np.zeros(0, dtype=np.intp)
        else:
            few = np.flatnonzero(shares[fingers, phalanges] < 1.0)
        return fingers[few], joints[few], phalanges[few]

    def loads(self, tensions: Array, lateral: Array) -> tuple[Array, Array]:
        """Return the tile loads of hands at rest for given tendon tensions.

        Parameters
        ----------
        tensions : ndarray, shape (F,)
            Tendon tensions [N].
        lateral : ndarray, shape (T,)
            Lateral loads of the tiles, which do not depend on tensions [N].

        Returns
        -------
        loads : ndarray, shape (T, 3)
            Shear, normal and lateral load of each tile [N]; shear and normal of nails zero.
        left : ndarray, shape (F, 3)
            Residual of each joint's balance, which a stop must carry, positive if closing [N·m].
        """
        loads = self._per_newton * tensions.take(self._known.places.finger)[:, None]
        loads += self._at_zero
        loads[:, 2] = lateral
        return loads, self._left_at_zero + self._left_per_newton * tensions[:, None]

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals of the joints' balance, tendons that must pull and joint stops."""
        names, (shear, normal, _) = self._names, again.loads.T
        planned, tensions, hands = again.arrays.loads, again.arrays.tensions, self._hand_of_finger
        off = planned[:, :2] - again.loads[:, :2]
        if len(self._known.places.nails):
            off[self._known.places.nails] = 0.0
        text = " carries {:.6g}, {:.6g} N, not what the plan says"
        tension = names.of_fingers("tension", np.arange(len(hands)))
        residuals = [
            Residual("zero", off, self._known.places.hand, names.tile, text, (shear, normal)),
            Residual("least", tensions, hands, tension, " is {:g} N", (tensions,)),
        ]
        if len(self._drawing):
            own = hands[self._drawing]
            slack = tensions[self._drawing] - self._closing[own]
            text = " would stick, slackened {:.3g} N"
            name = names.of_fingers("tendon", self._drawing)
            residuals.append(Residual("least", slack, own, name, text, (-slack,)))
        if len(self.stop_fingers):
            stops, text = self.stops(again.left), " would leave its stop"
            own, name = hands[self.stop_fingers], names.of_fingers("a joint", self.stop_fingers)
            # [N·m] by rounding a stop may seem to pull
            residuals.append(Residual("least", stops, own, name, text, error=1e-6))
        return residuals

    def stops(self, left: Array) -> Array:
        """Return the torque that presses each of the k joints at a stop against it, (k,) [N·m].

        Negative where the joint would leave its stop.

        Parameters
        ----------
        left : ndarray, shape (F, 3)
            Residual of each joint's balance, F fingers of all hands; positive if closing [N·m].
        """
        return np.asarray(left[self.stop_fingers, self.stop_joints] * self._sides)

    def solved(self, fingers: Fingers) -> tuple[Array, Array]:
        """Solve the balance of the free joints for the tiles' normal loads.

        Shears and torques may have further leading axes (…), which the results have, too.

        Parameters
        ----------
        fingers : Fingers
            Shears, torques and positions of all fingers.

        Returns
        -------
        normal : ndarray, shape (…, T)
            Normal load of each tile [N]; of nails zero.
        left : ndarray, shape (…, F, 3)
            Residual of each joint's balance, which a stop must carry, positive if closing [N·m].

        Raises
        ------
        numpy.linalg.LinAlgError
            If the contacts cannot balance the free joints.
        """
        rows, phalanges = self._axes_of(fingers.joints), self._known.places.phalanges
        moments = moments_of(rows, fingers.points, fingers.axes, phalanges)
        return self._balanced(fingers.shear, fingers.torques, moments)

    def _balanced(self, shear: Array, torques: Array, moments: Array) -> tuple[Array, Array]:
        """Return normal loads and what is left, as `solved`, by moments (2, F, 3, 3) of loads."""
        phalanges = self._known.places.phalanges
        left = torques - (moments[0] @ shear[..., phalanges, None])[..., 0]
        turns = moments[1] + moments[0] * self._rubs[phalanges][:, None]
        A, b = turns.copy(), left.copy()
        if self.held is not None:
            which, held = self.held.nonzero()
            idle, phalanx = (~self._bears).nonzero()
            if not np.array_equal(which, idle):
                raise np.linalg.LinAlgError("contacts do not hold the joints that are free")
            # in place of the balance of a joint that is held, the normal of what bears nothing is 0
            A[which, held], b[..., which, held] = 0.0, 0.0
            A[which, held, phalanx] = 1.0
        if len(self._few[0]):
            few, joint, bearing = self._few
            share, own = self._known.bearing_shares[few, bearing], A[self._few]
            A[few, joint] *= share[:, None]
            A[self._few] += (1.0 - share) * own
            b[..., few, joint] *= share
        normals = np.linalg.solve(A, b[..., None])
        normal = np.zeros(shear.shape)
        normal[..., phalanges] = normals[..., 0]
        return normal, left - (turns @ normals)[..., 0]

    def fingers(self, tensions: Array) -> Fingers:
        """Return the state of the fingers at rest for tendon tensions, shape (…, F) [N]."""
        known, at_rest = self._known, self._resting
        shear = self._shear + self._gain * tensions[..., known.places.finger]
        torques = at_rest.pull * tensions[..., None] + at_rest.springs
        return Fingers(shear, torques, at_rest.joints, known.points, known.axes)

    def _axes_of(self, joints: Array) -> Array:
        """Return the joints' axes where these are, as rows for wrenches, shape (F, 3, 6)."""
        return np.asarray(joints @ self._resting.turns + self._resting.axes)
