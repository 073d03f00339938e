"""One hand of a plan: where it is, what its fingers and its palm carry, and its set."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from planner import Finger
from service.replies.reply import PlacedFrame, Vector

__all__ = ["Generator", "Hand", "Palm", "Row", "Seating", "WrenchSet", "Wrist"]


class Palm(Struct, kw_only=True):
    """The palm: where it acts, its force there, and its moment about that point."""

    position: Vector
    force: Vector
    moment: Vector
    engaged: list[int]
    utilisation: float


class Seating(Struct):
    """Where the hold is in H, and how that was found.

    ``backed_off``: how far the hand moved off the rock along -z of H, so that its open fingers
    are clear [m].
    """

    rule: str
    pose: PlacedFrame
    backed_off: float = 0.0


class Wrist(Struct, kw_only=True):
    """How a hand's wrist is; all but ``mode`` are null where it is fixed.

    ``twist``: where it goes from the pose that was given, about that pose [m, rad]. ``palm``:
    ``off``, ``drags``, ``presses`` or ``drags_and_presses``. ``rounds``: how often the hands' sets
    were linearised. ``error``: how far the set of the last step was off at its end [N, moments over
    0.1 m]; the plan is exact. Of a wrench space, how far it is off at most where it reaches
    farthest along the axes.
    """

    mode: str
    twist: Vector | None = None
    palm: str | None = None
    rounds: int | None = None
    error: float | None = None


class Generator(Struct):
    """A column of a hand's wrench space: a load, and the wrench per newton of it.

    Of a floating hand a component of its wrist's twist, and the wrench per metre or radian.
    """

    name: str
    wrench: Vector


class Row(Struct, kw_only=True):
    """An inequality of a hand's wrench space.

    ``limit`` rows: load = coefficients · y + constant, at most utilisation · capacity; in newtons,
    for ``motor_torque`` and ``joint_torque`` in newton-metres, for ``motor_current`` in amperes.
    ``hard`` rows: coefficients · y at most capacity, whatever the utilisation.
    """

    name: str
    kind: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None
    coefficients: Vector
    constant: float
    capacity: float


class WrenchSet(Struct, kw_only=True):
    """A hand's wrenches, origin + Σ y · generator, for the loads y that the rows allow."""

    origin: Vector
    generators: list[Generator]
    rows: list[Row]


class Hand(Struct, kw_only=True):
    """One hand of a plan. Its wrench space comes with ``"want": ["model"]``."""

    limb: str
    wrench: Vector
    fingers: list[Finger]
    palm: Palm
    utilisation: float
    seating: Seating
    wrist: Wrist
    wrench_space: WrenchSet | UnsetType = UNSET
