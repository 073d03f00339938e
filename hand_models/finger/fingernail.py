"""The fingernail: an ultrashort phalanx at each fingertip, for shallow edges (Section 3.2).

The nail turns about a pin at the end of the distal phalanx, from straight ahead (ψ = 0) toward the
rock, on the softest spring of the finger, so the tendon moves the nail first. Where the nail meets
rock on its way it *hooks*, with its tip or with its flank on an edge; where it meets none it turns
by 180° and is out of the way.

To cling, the finger stays straight and only the nails carry. With w the unit vector along the nail
and v the one across it, in which the tendon turns it, a nail that touches at the distance c from
its pin loads the rock with F = P v − A w. P follows from the tendon's tension f by the balance
about the pin; A goes through the pin and is passive. The rock, with its normal n (of the nail's
flank where that touches), carries F by friction, and F must not close the finger: its joints are
at stops against opening (``assumed``; nothing is published), and tendon and nail both turn them.
With joint i at q_i, local tensions f_i of Eq. 8, pulley radii r, spring stiffnesses K and preloads
p (index n for the nail), and the nail's friction μ_n,

    P = (f_n r_n − K_n ψ − p_n) / c,
    |F along the rock| ≤ μ_n · (F into the rock),
    f_i r_i − p_i + (F × (tip − q_i), from x toward z) ≤ 0.

So a straight finger is much like a rope: it pulls toward its base, but hardly off the rock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.finger.settled_finger import SettledFinger
from hand_models.parameters import ParameterTable
from hand_models.sections import Face, Section, Vector2

__all__ = ["Cling", "Fingernail", "Hook"]


class Hook(NamedTuple):
    """Contact of a nail with the rock, in the coordinates (x, z) of the finger frame F.

    Attributes
    ----------
    angle : float
        ψ, angle of the nail from straight ahead toward the rock [rad].
    distance : float
        c, distance of the contact from the nail's pin [m].
    normal : tuple of float
        Unit vector out of the rock.
    """

    angle: float
    distance: float
    normal: Vector2

    @property
    def along(self) -> Array:
        """w, unit vector (x, z) along the nail from its pin, shape (2,)."""
        return np.array([math.cos(self.angle), math.sin(self.angle)])

    @property
    def across(self) -> Array:
        """v, unit vector (x, z) across the nail, in which the tendon turns it, shape (2,)."""
        return np.array([-math.sin(self.angle), math.cos(self.angle)])


class Cling(NamedTuple):
    """A hooked nail, its force P, and the conditions under which rock and finger can carry it.

    Attributes
    ----------
    hook : Hook
    force : tuple of float
        P, force across the nail: at zero tension [N], and per newton of the tendon's tension.
    H : ndarray, shape (6, 2)
        The nail stays hooked at the tendon tension f and the axial force A if H (f, A) ≤ h. Three
        rows of the friction cone, the first of which keeps the nail from pulling on the rock, then
        one row for each joint, proximal first, as a force at the nail's pin.
    h : ndarray, shape (6,)
        Right-hand side of ``H`` [N].
    """

    hook: Hook
    force: tuple[float, float]
    H: Array
    h: Array

    def lasts(self, tension: float) -> bool:
        """Return True if at a tension [N] the nail reaches its hook and can stay hooked.

        The nail stays hooked if some axial force A satisfies ``H (f, A) ≤ h`` at the tension f.
        """
        if self.force[0] + self.force[1] * tension < 0.0:
            return False
        slope, left = self.H[:, 1], self.h - self.H[:, 0] * tension
        below, above, still = slope < 0.0, slope > 0.0, slope == 0.0
        least = (left[below] / slope[below]).max(initial=-math.inf)
        most = (left[above] / slope[above]).min(initial=math.inf)
        return bool(least <= most and left[still].min(initial=0.0) >= 0.0)


@dataclass(frozen=True)
class Fingernail:
    """Geometry, spring and friction of a nail; the four nails are alike. SI units.

    Attributes
    ----------
    length : float
        Distance from the pin to the tip [m].
    pulley_radius : float
        r_n, radius of the nail's pulley [m].
    stiffness, preload : float
        Spring stiffness K_n [N·m/rad] and spring preload p_n [N·m].
    retraction : float
        Angle at which the nail is out of the way [rad].
    friction : float
        μ_n, friction of the nail on rock.
    """

    length: float
    pulley_radius: float
    stiffness: float
    preload: float
    retraction: float
    friction: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> Fingernail:
        """Read the nail's numbers from a table of ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or impossible.
        """
        numbers = {field.name: table.scalar("nail", field.name) for field in fields(cls)}
        for name, value in numbers.items():
            if name in ("length", "pulley_radius", "retraction"):
                table.positive("nail", name)
            if not value >= 0.0:
                raise InvalidInputError(f"must be at least 0, got {value:g}", field=f"nail.{name}")
        return cls(**numbers)

    @property
    def _face(self) -> Face:
        # rock nearer the pin than 0.1 mm is not looked for
        return Face(1e-4, self.length, 0.0)

    def stuck(self, section: Section | None, pin: Vector2) -> bool:
        """Return True if rock is already in the way of a nail that points straight ahead.

        Parameters
        ----------
        section : Section or None
            Rock in the finger's plane, in the coordinates (x, z) of F; None if there is none.
        pin : tuple of float
            (x, z) of the nail's pin, the finger straight along x [m].
        """
        if section is None:
            return False
        return section.face_clearance(complex(*pin), 1.0, self._face) <= 0.0

    def hook(self, section: Section | None, pin: Vector2) -> Hook | None:
        """Turn the nail from straight ahead until its tip or flank meets the rock.

        Parameters
        ----------
        section : Section or None
            Rock in the finger's plane, in the coordinates (x, z) of F; the nail is not `stuck`
            there.
        pin : tuple of float
            (x, z) of the nail's pin, the finger straight along x [m].

        Returns
        -------
        Hook or None
            None if the nail turns to ``retraction`` without meeting rock.
        """
        if section is None:
            return None
        rest = section.rest(complex(*pin), self._face, 0.0, self.retraction)
        if rest is None:
            return None
        met = Hook(rest.angle, rest.distance, (0.0, 0.0))
        if rest.distance < self.length:
            s, t = -met.across
            return met._replace(normal=(float(s), float(t)))
        s, t = np.asarray(pin) + self.length * met.along
        return met._replace(normal=section.normal((float(s), float(t))))

    def cling(
        self, section: Section | None, finger: SettledFinger, tension: float, base_tile: bool
    ) -> Cling | None:
        """Return the hook, force and conditions of a straight finger's nail that clings to rock.

        Parameters
        ----------
        section : Section or None
            Rock in the finger's plane, in the coordinates (x, z) of F; None if there is none.
        finger : SettledFinger
            The straight finger.
        tension : float
            Closing tension [N].
        base_tile : bool
            Whether a base tile comes first on the tendon.

        Returns
        -------
        Cling or None
            None if the nail meets no rock, or if it cannot stay on the rock at the closing tension
            without closing the finger.
        """
        hook = self.hook(section, finger.pin)
        if hook is None:
            return None
        model = finger.model
        losses = model.losses(base_tile)
        arm = self.pulley_radius * float(losses[-1]) * (1.0 - model.friction)
        held = self.preload + self.stiffness * hook.angle
        at_zero, per_newton = -held / hook.distance, arm / hook.distance
        # columns: the force on the rock at zero tension, per newton of tension, per newton of A
        force = np.column_stack([at_zero * hook.across, per_newton * hook.across, -hook.along])
        n = np.array(hook.normal)
        slip, side = self.friction * n, np.array([-n[1], n[0]])
        # the reaction −F turns a joint, at the distance D from the pin, from x toward z
        D = finger.pin[0] - np.array([contact.joint[0] for contact in finger.contacts])
        x, z = hook.distance * hook.along
        closing = np.column_stack([z / D, -1.0 - x / D])
        rows = np.vstack([n, slip + side, slip - side, closing]) @ force
        of_joints = rows[3:]  # below those of the cone
        of_joints[:, 0] -= np.asarray(model.joint_preload) / D
        of_joints[:, 1] += losses * np.asarray(model.pulley_radii) / D
        made = Cling(hook, (at_zero, per_newton), rows[:, 1:], -rows[:, 0])
        return made if made.lasts(tension) else None
