"""Stances: poses of the body and of its hands on their holds, and joint angles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose, finite_vector
from hand_models.fixed_wrist import SEAT_RULES, SeatRule
from hand_models.hand import FINGERS, Grasp, WristTravel
from hand_models.rock import Hold
from hand_models.tile import Surface
from planner.question.limits import LimbStiffness
from planner.robots import Robot, robosimian

__all__ = [
    "EARTH_GRAVITY",
    "HandOnHold",
    "Stance",
    "checked_body_wrench",
    "known_choice",
    "known_limbs",
]

WristMode = Literal["fixed", "floating", "compliant"]

EARTH_GRAVITY: Final = (0.0, 0.0, -9.81)
"""Default gravity in the world frame W [m/s²] (the contract's figure)."""


def known_limbs(named: Mapping[str, object], robot: Robot, field: str) -> None:
    """Check that all keys of a mapping are limbs of the robot.

    Parameters
    ----------
    named : mapping of str to object
        Mapping whose keys are checked.
    robot : Robot
        Robot that has the limbs.
    field : str
        Field that the error names.

    Raises
    ------
    InvalidInputError
        If a key is not a limb of the robot.
    """
    for limb in named:
        if limb not in robot.limbs:
            raise InvalidInputError(
                f"unknown limb; known are {', '.join(robot.limbs)}", field=f"{field}.{limb}"
            )


def known_choice(value: str, known: Sequence[str], field: str) -> None:
    """Check that the value of a field is one of the known choices.

    Parameters
    ----------
    value : str
        Value of the field.
    known : sequence of str
        Valid values.
    field : str
        Field that the error names.

    Raises
    ------
    InvalidInputError
        If the value is not one of them.
    """
    if value not in known:
        raise InvalidInputError(
            f"unknown {field} {value!r}; known are {', '.join(known)}", field=field
        )


def checked_body_wrench(wrench: Array, field: str | None) -> Array:
    """Return a wrench unchanged, shape (6,) [N, N·m], after a check of its size.

    Parameters
    ----------
    wrench : ndarray, shape (6,)
        Wrench to be checked [N, N·m].
    field : str or None
        Field that the error names.

    Raises
    ------
    InvalidInputError
        If a component exceeds 1e12 N or N·m, or is NaN.
    """
    most = 1e12  # [N, N·m] larger, the unit is wrong
    if not np.abs(wrench).max() <= most:
        raise InvalidInputError(
            f"every component of the wrench must be within ±{most:g} N or N·m, got "
            f"{wrench.tolist()}",
            field=field,
        )
    return wrench


def _possible(pose: Pose, field: str) -> None:
    """Refuse a pose that is not finite, absurdly far, or whose axes are not orthonormal."""
    place = pose.position
    if not pose.proper:
        place = finite_vector(place, 3, f"{field}.position")
    position = place.tolist()
    farthest = 1e9  # [m]; farther its digits are all lost
    if max(map(abs, position)) > farthest:
        raise InvalidInputError(
            f"must be within ±{farthest:g} m, got {position}", field=f"{field}.position"
        )
    if pose.proper:
        return
    axes = finite_vector(np.ravel(pose.rotation), 9, f"{field}.orientation").reshape(3, 3)
    off = np.append(axes.T @ axes - np.eye(3), np.linalg.det(axes) - 1.0)
    if not np.abs(off).max() <= 1e-6:  # rounding of the axes' products
        raise InvalidInputError(
            "must be orthonormal right-handed axes, to 1e-6; the largest error is "
            f"{np.abs(off).max():.2g}",
            field=f"{field}.orientation",
        )


@dataclass(frozen=True, eq=False)
class HandOnHold:
    """One hand of a stance, with its hold and the hold's surface.

    Attributes
    ----------
    limb : str
        Limb of the robot that has the hand.
    pose : Pose
        Pose of the hand frame H in the world frame W.
    hold : Hold
        Shape of the rock.
    surface : Surface
        Strength of a spine tile on the rock.
    hold_pose : Pose, optional
        Pose of the hold's frame in W.
    hold_in_hand : Pose, optional
        Pose of the hold's frame in H. If neither pose is given, the hand is seated on the hold.
    grasp : Grasp
        How the fingers close: closing tension and angles of the outer fingers.
    wrist : {'fixed', 'floating', 'compliant'}
        ``fixed``: the wrist keeps its pose, motors give each tendon its planned tension.
        ``floating``: motors stand still, the wrist moves. ``compliant``: motors drive the tendons,
        the wrist moves.
    wrist_travel : WristTravel, optional
        Range in which a compliant wrist may settle; `WristTravel` by default.
    tendon_preload : ndarray, shape (4,), optional
        Tensions of a floating hand's tendons at rest [N]; the closing tension by default.
    wrench : tuple of float or None, length 6, optional
        Prescribed wrench of the hand on the rock, in H [N, N·m]; None for a free component.
    seat : {'rest', 'best'}
        How a hand without a pose of its hold is seated: ``rest``: as its grasp closes; ``best``:
        near that pose, where it can exert most (`hand_models.fixed_wrist.seat_search`).
    seat_direction : ndarray, shape (6,), optional
        Wrench on the rock, in H, in whose direction the best seat can exert most; the pull-off by
        default.
    at : Pose, optional
        Where on the hold the hand is seated: a frame in the hold's frame, used in place of that
        frame.
    contact_offset : Pose, optional
        Pose of H in its frame at rest, where the unloaded hand rests, for a hand placed by contact
        (`planner.come_to_rest`). None for a hand that is where it was put or seated.
    """

    limb: str
    pose: Pose
    hold: Hold
    surface: Surface
    hold_pose: Pose | None = None
    hold_in_hand: Pose | None = None
    grasp: Grasp = field(default_factory=Grasp)
    wrist: WristMode = "fixed"
    tendon_preload: Array | None = None
    wrist_travel: WristTravel | None = None
    wrench: tuple[float | None, ...] | None = None
    seat: SeatRule = "rest"
    seat_direction: Array | None = None
    at: Pose | None = None
    contact_offset: Pose | None = None

    def __post_init__(self) -> None:
        known_choice(self.wrist, get_args(WristMode), "wrist")
        if self.wrist_travel is not None and self.wrist != "compliant":
            raise InvalidInputError(
                f"requires wrist 'compliant', got {self.wrist!r}: change wrist, or leave it out",
                field="wrist_travel",
            )
        if self.tendon_preload is not None:
            if self.wrist != "floating":
                raise InvalidInputError(
                    f"requires wrist 'floating', got {self.wrist!r}: change wrist, or leave it out",
                    field="tendon_preload",
                )
            preload = finite_vector(self.tendon_preload, len(FINGERS), "tendon_preload")
            object.__setattr__(self, "tendon_preload", preload)
        if self.wrench is not None:
            if len(self.wrench) != 6:
                raise InvalidInputError(
                    f"6 components are needed, as fx, fy, fz, mx, my, mz, got {len(self.wrench)}",
                    field="wrench",
                )
            given = [0.0 if value is None else value for value in self.wrench]
            checked_body_wrench(finite_vector(given, 6, "wrench"), "wrench")
        self._check_seat()
        if self.hold_pose is not None and self.hold_in_hand is not None:
            raise InvalidInputError("give pose or pose_in_hand, not both", field="hold")
        _possible(self.pose, "pose")
        if self.hold_pose is not None:
            _possible(self.hold_pose, "hold.pose")
        if self.hold_in_hand is not None:
            _possible(self.hold_in_hand, "hold.pose_in_hand")

    def _check_seat(self) -> None:
        known_choice(self.seat, SEAT_RULES, "seat")
        posed = self.hold_pose is not None or self.hold_in_hand is not None
        given = {"seat": self.seat == "best", "at": self.at is not None}
        for name, left_out in (("seat", "the seat"), ("at", "where it is seated")):
            if given[name] and posed:
                raise InvalidInputError(
                    "cannot be combined with a hold's pose: remove pose and pose_in_hand, or "
                    f"{left_out}",
                    field=name,
                )
        if self.at is not None:
            _possible(self.at, "at")
        if self.contact_offset is not None:
            _possible(self.contact_offset, "contact_offset")
            if not posed:
                raise InvalidInputError(
                    "requires the pose of the hold, as planner.come_to_rest gives it; give the "
                    "pose, or remove contact_offset",
                    field="contact_offset",
                )
        if self.seat_direction is not None:
            if self.seat != "best":
                raise InvalidInputError(
                    f"requires the seat 'best', got {self.seat!r}: change seat, or leave it out",
                    field="seat_direction",
                )
            direction = finite_vector(self.seat_direction, 6, "seat_direction")
            if not direction.any():
                raise InvalidInputError(
                    "must be the direction of a wrench, not zero", field="seat_direction"
                )
            object.__setattr__(self, "seat_direction", direction)

    def placed_hold(self) -> Pose | None:
        """Return the pose of the hold's frame in H; None if the hand is to be seated."""
        if self.hold_pose is None:
            return self.hold_in_hand
        axes = self.pose.rotation.T
        return Pose(
            axes @ (self.hold_pose.position - self.pose.position), axes @ self.hold_pose.rotation
        )


@dataclass(frozen=True, eq=False)
class Stance:
    """Hands on holds around a body.

    Attributes
    ----------
    hands : tuple of HandOnHold
        One to as many hands as the robot has limbs; each limb at most once.
    body : Pose
        Pose of the body frame B in the world frame W.
    gravity : ndarray, shape (3,)
        Acceleration of gravity, in W [m/s²].
    robot : Robot
        The robot; RoboSimian by default.
    joints : mapping of str to (ndarray or 'solve'), 'solve' or None
        Joint angles by limb [rad], of prismatic joints [m]; needed for every limb with a hand in
        the stance. 'solve', for one limb or for all: found by inverse kinematics. None: joints are
        not known, and joint torques do not count.
    limb_stiffness : LimbStiffness, optional
        Stiffness with which limbs keep compliant or floating wrists at their targets; if given,
        plans contain a pose target for each such wrist.
    """

    hands: tuple[HandOnHold, ...]
    body: Pose
    gravity: Array = field(default_factory=lambda: np.array(EARTH_GRAVITY))
    robot: Robot = field(default_factory=robosimian)
    joints: Mapping[str, Array | Literal["solve"]] | Literal["solve"] | None = None
    limb_stiffness: LimbStiffness | None = None

    def __post_init__(self) -> None:
        self._check_hands()
        if isinstance(self.joints, str):
            if self.joints != "solve":
                raise InvalidInputError(
                    f"valid are angles of each limb, or 'solve'; got {self.joints!r}",
                    field="joints",
                )
        elif self.joints is not None:
            chains = self.robot.chains
            known_limbs(self.joints, self.robot, "joints")
            holding = {hand.limb for hand in self.hands}
            joints: dict[str, Array | Literal["solve"]] = {}
            for limb, angles in self.joints.items():
                if not isinstance(angles, str):
                    count = len(chains[limb].joints)
                    joints[limb] = finite_vector(angles, count, f"joints.{limb}")
                elif angles == "solve" and limb in holding:
                    joints[limb] = "solve"
                else:
                    raise InvalidInputError(
                        f"valid are angles or, of a limb with a hand in the stance, 'solve'; "
                        f"got {angles!r}",
                        field=f"joints.{limb}",
                    )
            object.__setattr__(self, "joints", joints)

    @property
    def given_joints(self) -> dict[str, Array]:
        """Joint angles that the stance gives, by limb, shape (n,) [rad]; prismatic joints [m]."""
        joints = {} if self.joints is None or isinstance(self.joints, str) else self.joints
        return {limb: each for limb, each in joints.items() if not isinstance(each, str)}

    @property
    def solved_limbs(self) -> frozenset[str]:
        """Limbs with a hand whose joint angles are to be found by inverse kinematics."""
        holding = [hand.limb for hand in self.hands]
        if self.joints is None or isinstance(self.joints, str):
            return frozenset(holding if self.joints else ())
        return frozenset(limb for limb, each in self.joints.items() if isinstance(each, str))

    def _check_hands(self) -> None:
        if not self.hands:
            raise InvalidInputError("at least one hand is needed", field="hands")
        _possible(self.body, "body")
        object.__setattr__(self, "gravity", finite_vector(self.gravity, 3, "gravity"))
        seen: set[str] = set()
        limbs, reach, origin = self.robot.limbs, self.robot.reach, self.body.position.tolist()
        for i, hand in enumerate(self.hands):
            if hand.limb not in limbs:
                raise InvalidInputError(
                    f"unknown limb {hand.limb!r}; known are {', '.join(limbs)}",
                    field=f"hands[{i}].limb",
                )
            if hand.limb in seen:
                raise InvalidInputError(
                    f"limb {hand.limb!r} appears twice; a limb has one hand",
                    field=f"hands[{i}].limb",
                )
            seen.add(hand.limb)
            away = math.dist(hand.pose.position.tolist(), origin)
            if away > 10.0 * reach:  # farther, the unit is wrong
                raise InvalidInputError(
                    f"the hand is {away:.3g} m from the body; at most ten times the limbs' reach, "
                    f"{10.0 * reach:.2g} m, is possible: is the position in W, in metres?",
                    field=f"hands[{i}].pose.position",
                )
