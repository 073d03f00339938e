"""Where faces meet profiles, a disc swept along a wedge and cut obliquely, in closed form.

In the coordinates q of its section such rock is the convex preimage of the profile under ``p = M q
+ m`` (`hand_models.sections.profile_section`). With w from the joint to the middle of the disc's
preimage, an ellipse, and S = M⁻¹ M⁻ᵀ, the first of the ellipse's points in the direction n = (−sin
θ, cos θ) is

    x(θ) = w − r S n / √(nᵀ S n)

from the joint. A face at the height h meets a point x at the angle T(x) = atan2(x_z, x_x) − asin(h
/ |x|), and the ellipse first where T is least on it: from an angle θ beyond, T(x(θ)) is nearer, and
soon there (Newton's method, from one side). An end of a face meets the ellipse where a conic
crosses the unit circle (`hand_models.sections.conics`), and a flat face of the rock like any
straight rock. The rock is convex, so each of these counts where it is on its own part of the
boundary.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.sections.conics import circle_crossings
from hand_models.sections.rows import Complexes, Flags, Rests, Span, angles_within
from hand_models.sections.section import FACE_SAMPLES, LEVEL

__all__ = ["ProfileRows"]

ITERATIONS: Final = 30
"""Steps toward a tangency, at most; about four are needed."""

CONVERGED: Final = 1e-9
"""Change of an angle from which one more step leaves nothing but rounding [rad]."""

ROUNDING: Final = 1e-14
"""The same where the rock is far larger than a phalanx, for its size seen from the joint."""

JOINED: Final = 1e-12
"""How far beyond the end of the arc or of a flat face a place may seem to be, for its distance."""

PARTS: Final = np.linspace(0.0, 1.0, FACE_SAMPLES)[:, None]
"""Where along a face its distance from the rock is taken."""

SIDES: Final = np.array([[1.0], [-1.0]])
"""Of the profile, on which its two flat faces are."""


class _Numbers(NamedTuple):
    """Profiles and their preimages.

    Attributes
    ----------
    M : ndarray, shape (4, n)
        M_xs, M_xt, M_zs, M_zt.
    m : ndarray, shape (2, n)
        With M, to the coordinates of the profile about the middle of its disc [m].
    inverse : ndarray, shape (4, n)
        M⁻¹.
    turn : ndarray, shape (n,)
        Sign of M's determinant.
    radius : ndarray, shape (n,)
        [m]
    middle : ndarray, shape (2, n)
        Of the ellipse [m].
    S : ndarray, shape (3, n)
        S_ss, S_st, S_tt.
    squares : ndarray, shape (2, n)
        Eigenvalues of MᵀM, the larger one first.
    axis : ndarray, shape (n,)
        Angle of its first eigenvector [rad].
    axes : ndarray, shape (4, n)
        Both eigenvectors' images under M.
    wedge : ndarray, shape (2, n)
        Sine and cosine of half the angle between the flat faces.
    normals, toward : ndarray, shape (2, n)
        Length and angle of the gradients in q of the distances from both flat faces.
    """

    M: Array
    m: Array
    inverse: Array
    turn: Array
    radius: Array
    middle: Array
    S: Array
    squares: Array
    axis: Array
    axes: Array
    wedge: Array
    normals: Array
    toward: Array


class ProfileRows:
    """Profiles cut obliquely; of a single one, for any number of rows.

    Parameters
    ----------
    M : ndarray, shape (n, 2, 2)
    m : ndarray, shape (n, 2)
        As of `ProfileSection`.
    radius : ndarray, shape (n,)
        [m]
    half_angle : ndarray, shape (n,), or None
        Half the angle of the rock between the flat faces; None if all are round [rad].
    """

    def __init__(self, M: Array, m: Array, radius: Array, half_angle: Array | None) -> None:
        self._edged = half_angle is not None
        half = np.zeros_like(radius) if half_angle is None else half_angle
        m = m.copy()
        m[:, 1] -= radius
        inverse = np.asarray(np.linalg.inv(M), dtype=float)
        S, G = inverse @ inverse.transpose(0, 2, 1), M.transpose(0, 2, 1) @ M
        mean, uneven = 0.5 * (G[:, 0, 0] + G[:, 1, 1]), 0.5 * (G[:, 0, 0] - G[:, 1, 1])
        spread, axis = np.hypot(uneven, G[:, 0, 1]), 0.5 * np.arctan2(G[:, 0, 1], uneven)
        u, v = np.cos(axis), np.sin(axis)
        axes = M @ np.stack([u, -v, v, u], axis=1).reshape(-1, 2, 2)
        wedge = np.array([np.sin(half), np.cos(half)])
        # gradients in the profile times M: (± cosine, − sine)
        across, down = wedge[1] * M[:, 0].T, wedge[0] * M[:, 1].T
        s, t = np.stack([across - down, -across - down], axis=1)
        numbers = _Numbers(
            M=M.reshape(-1, 4).T,
            m=m.T,
            inverse=inverse.reshape(-1, 4).T,
            turn=np.sign(np.linalg.det(M)),
            radius=radius,
            middle=-(inverse @ m[:, :, None])[:, :, 0].T,
            S=S.reshape(-1, 4)[:, [0, 1, 3]].T,
            squares=np.array([mean + spread, mean - spread]),
            axis=axis,
            axes=axes.transpose(0, 2, 1).reshape(-1, 4).T,
            wedge=wedge,
            normals=np.hypot(s, t),
            toward=np.arctan2(t, s),
        )
        self._numbers = _Numbers(*(np.ascontiguousarray(value) for value in numbers))

    def take(self, rows: Indices) -> ProfileRows:
        """Return some of the rows, or the same ones more than once."""
        if self._numbers.radius.shape[-1] == 1:
            return self
        taken = object.__new__(ProfileRows)
        taken._edged = self._edged
        taken._numbers = _Numbers(*(value[..., rows] for value in self._numbers))
        return taken

    # Faces that turn ------------------------------------------------------------------------------

    def rests(self, joint: Complexes, span: Span, low: Array, high: Array) -> Rests:
        """Return where faces first meet the rock as their phalanges turn from low to high."""
        blocked = self.face_clearances(joint, span, low) <= 0.0
        angle, distance = self.tangents(joint, span, low, high)
        start, end = span.ends
        on = (angle <= high) & (distance >= start) & (distance <= end)
        flat = np.zeros(on.shape, dtype=bool)
        off = (~on).nonzero()[0]
        if len(off):
            rock, rest = self.take(off), (joint[off], span.take(off), low[off], high[off])
            angle[off], distance[off], flat[off] = rock._ends(*rest)
        return Rests(angle, distance, flat, blocked)

    def _ends(
        self, joint: Complexes, span: Span, low: Array, high: Array
    ) -> tuple[Array, Array, Flags]:
        """Return where faces meet the rock with one of their ends, or both."""
        first, last = self.touches(joint, span, low, high)
        start, end = span.ends
        angle = np.fmin(first, last)
        distance = np.where((first <= last) | np.isnan(last), start, end)
        flat = np.abs(first - last) * (end - start) <= LEVEL
        if flat.any():
            flat &= self._straight(joint, span, angle)
        return angle, distance, flat

    def tangents(
        self, joint: Complexes, span: Span, low: Array, high: Array
    ) -> tuple[Array, Array]:
        """Return angle and distance at which the faces' lines touch the curved part of the rock.

        NaN where they do not.
        """
        rock, h = self._numbers, span.height
        s_ss, s_st, s_tt = rock.S
        w_s, w_t = rock.middle[0] - joint.real, rock.middle[1] - joint.imag
        # the tangent from the joint itself, a circle's in the profile; none from inside
        p_x, p_z = self._in_profile(joint)
        away = np.sqrt(p_x * p_x + p_z * p_z)
        part = rock.radius / away
        rise = rock.turn * np.sqrt(1.0 - part * part)
        t_x, t_z = part * (part * p_x - rise * p_z), part * (part * p_z + rise * p_x)
        a, b, c, d = rock.inverse
        s, t = w_s + a * t_x + b * t_z, w_t + c * t_x + d * t_z
        distance = np.sqrt(s * s + t * t)
        enough = CONVERGED + ROUNDING * (np.abs(w_s) + np.abs(w_t)) / distance
        theta = np.arctan2(t, s) - np.arcsin(h / distance)
        # a joint nearer the ellipse than the face is high has no such angle; most are known at once
        theta[away - rock.radius < h * np.sqrt(rock.squares[1])] = np.nan
        still: Flags | None = None
        for _ in range(ITERATIONS):
            u, v = np.cos(theta), np.sin(theta)
            n_s, n_t = s_st * u - s_ss * v, s_tt * u - s_st * v
            part = rock.radius / np.sqrt(u * n_t - v * n_s)
            s, t = w_s - part * n_s, w_t - part * n_t
            if still is not None and not still.any():
                break
            before, theta = theta, np.arctan2(t, s) - np.arcsin(h / np.sqrt(s * s + t * t))
            still = np.abs(theta - before) > enough
        assert still is not None
        theta[still] = np.nan
        if self._edged:
            # the flat faces go on beyond the line of the face
            sine, cosine = rock.wedge
            theta[~(cosine * (b * -v + d * u) >= sine * np.abs(a * -v + c * u))] = np.nan
        return angles_within(theta, low, high), s * u + t * v

    def touches(self, joint: Complexes, span: Span, low: Array, high: Array) -> Array:
        """Return the first angle at which both ends of faces are on the rock, (2, n); or NaN."""
        rock, arms = self._numbers, span.arms
        p_x, p_z = self._in_profile(joint)
        a_x, a_z, b_x, b_z = rock.axes
        distance = np.sqrt(p_x * p_x + p_z * p_z)
        outside = (distance - rock.radius) * (distance + rock.radius)
        first, second = arms * (a_x * p_x + a_z * p_z), arms * (b_x * p_x + b_z * p_z)
        square, lesser = rock.squares
        angles, slopes = circle_crossings(
            arms * arms * square, arms * arms * lesser, first, second, outside
        )
        if not self._edged:
            angles[slopes >= 0.0] = np.nan
            return np.asarray(
                np.fmin.reduce(angles_within(angles + rock.axis - span.phases, low, high))
            )
        # on which side of the end of the arc each place is
        sine, cosine = rock.wedge
        u, v = np.cos(angles), np.sin(angles)
        x, z = p_x + arms * (a_x * u + b_x * v), p_z + arms * (a_z * u + b_z * v)
        slack = JOINED * (distance + arms)
        angles[~((slopes < 0.0) & (sine * np.abs(x) + cosine * z <= slack))] = np.nan
        angles += rock.axis
        # across the lines of the flat faces
        sides = SIDES * cosine * p_x - sine * p_z
        entered = rock.toward[:, None] + np.arccos(
            ((rock.radius - sides) / rock.normals)[:, None] / arms
        )
        x, z = self._in_profile(joint + arms * np.exp(1j * entered))
        entered[~(SIDES[:, None] * sine * x + cosine * z >= -slack)] = np.nan
        angles = np.concatenate([angles, entered])
        return np.asarray(np.fmin.reduce(angles_within(angles - span.phases, low, high)))

    def _straight(self, joint: Complexes, span: Span, angle: Array) -> Flags | bool:
        """Whether the rock nearest both ends of faces at an angle is straight."""
        if not self._edged:
            return False
        sine, cosine = self._numbers.wedge
        ends = joint + (span.ends + 1j * span.height) * np.exp(1j * angle)
        x, z = self._in_profile(ends)
        x = np.abs(x)
        flat = (sine * x + cosine * z >= 0.0) & (cosine * x - sine * z >= 0.0)
        return np.asarray(flat.all(axis=0))

    # Distances ------------------------------------------------------------------------------------

    def clearances(self, points: Complexes) -> Array:
        """Return about how far points (..., n) are from the rock, negative inside [m]."""
        return self._distances(*self._in_profile(points))

    def face_clearances(self, joint: Complexes, span: Span, angle: Array) -> Array:
        """Return about how far faces at an angle are from the rock, negative if they cut it [m]."""
        a, b, c, d = self._numbers.M
        u = np.exp(1j * angle)
        start, end = span.ends
        p_x, p_z = self._in_profile(joint + (start + 1j * span.height) * u)
        u *= end - start
        p_x = p_x + PARTS * (a * u.real + b * u.imag)
        p_z = p_z + PARTS * (c * u.real + d * u.imag)
        return np.asarray(self._distances(p_x, p_z).min(axis=0))

    def _distances(self, x: Array, z: Array) -> Array:
        """Return how far places in the profile are from it, negative inside [m]."""
        distance = np.sqrt(x * x + z * z)
        if self._edged:
            sine, cosine = self._numbers.wedge
            x = np.abs(x)
            beside = sine * x + cosine * z >= 0.0
            distance = np.where(beside, cosine * x - sine * z, distance)
        return np.asarray(distance - self._numbers.radius)

    def _in_profile(self, points: Complexes) -> tuple[Array, Array]:
        """Return places in the profile, about the middle of its disc."""
        a, b, c, d = self._numbers.M
        e, f = self._numbers.m
        return a * points.real + b * points.imag + e, c * points.real + d * points.imag + f
