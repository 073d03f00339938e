"""Distances of pairs of capsules, at many postures (compiled)."""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["capsule_distances"]


@compiled()
def _clipped(value: float) -> float:
    return min(max(value, 0.0), 1.0)


@compiled()
def _apart(a: Array, b: Array, far: float) -> float:
    """Return the distance of two segments (2, 3); a lower bound of it where that is over ``far``.

    Ericson, *Real-Time Collision Detection* (2005), section 5.1.9.
    """
    aa = bb = ab = ar = br = rr = mm = 0.0
    for k in range(3):
        u, v, r = a[1, k] - a[0, k], b[1, k] - b[0, k], a[0, k] - b[0, k]
        middle = r + 0.5 * (u - v)
        aa += u * u
        bb += v * v
        ab += u * v
        ar += u * r
        br += v * r
        rr += r * r
        mm += middle * middle
    least = math.sqrt(mm) - 0.5 * (math.sqrt(aa) + math.sqrt(bb))
    if least > far:
        return least
    s = t = 0.0
    if aa <= 0.0:
        t = _clipped(br / bb) if bb > 0.0 else 0.0
    elif bb <= 0.0:
        s = _clipped(-ar / aa)
    else:
        across = aa * bb - ab * ab
        s = _clipped((ab * br - ar * bb) / across) if across > 1e-12 * aa * bb else 0.0
        t = (ab * s + br) / bb
        if t < 0.0 or t > 1.0:
            t = _clipped(t)
            s = _clipped((ab * t - ar) / aa)
    square = 0.0
    for k in range(3):
        away = a[0, k] - b[0, k] + s * (a[1, k] - a[0, k]) - t * (b[1, k] - b[0, k])
        square += away * away
    return math.sqrt(square)


@compiled("f4", "f1", "i2", "f0")
def capsule_distances(segments: Array, radii: Array, pairs: Indices, far: float) -> Array:
    """Return the distances of pairs of capsules, shape (S, k) [m]; negative where they overlap.

    Parameters
    ----------
    segments : ndarray, shape (S, n, 2, 3)
        Ends of the segments of n capsules in S postures [m].
    radii : ndarray, shape (n,)
        Radii of the capsules [m].
    pairs : ndarray of int, shape (k, 2)
        Which are measured from each other.
    far : float
        Distance up to which it is exact; of those that are farther apart it is a lower bound [m].
    """
    found = np.empty((len(segments), len(pairs)))
    for s in range(len(segments)):
        for k in range(len(pairs)):
            i, j = pairs[k]
            both = radii[i] + radii[j]
            found[s, k] = _apart(segments[s, i], segments[s, j], far + both) - both
    return found
