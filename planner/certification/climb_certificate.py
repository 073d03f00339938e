"""A climb's certificate: all that its bound rests on as plain arrays, its file, and its digest."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, ClassVar, Self
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, InvalidInputError, reading_file, whole_file

__all__ = ["ClimbCertificate"]


@dataclass(frozen=True, eq=False, kw_only=True)
class ClimbCertificate:
    """The claim that no climb has a least load factor of ``multiple``, and what it rests on.

    A state is a pose of the body with hands on the rock, all or all but one. A climb goes from
    states with all hands to states without one and back at the same body, and with all hands from
    body to body of ``shifts``. Wrenches are those of the rock on the robot, in the axes of the
    world frame W about one point, over ``unit``.

    Attributes
    ----------
    limbs : tuple of str, length L
    multiple : float
        No climb from the start to the goal has states whose load factors are all at least this.
    backward : bool
        Whether the check goes from the goal to the start, as fewer states are connected with it.
    points : ndarray, shape (n, 6)
        Wrenches of the vertices of all parts (fingers, palms) of all hands.
    rows : ndarray, shape (n, k)
        What each vertex adds to the rows of its whole hand, over the row's size.
    parts : ndarray of int, shape (parts + 1,)
        Index of the first vertex of each part.
    hands : ndarray of int, shape (P + 1,)
        Index of the first part of each placement's hand.
    base : ndarray, shape (P, 6)
        Wrench of each hand without loads.
    room : ndarray, shape (P, k)
        Capacities of the rows; infinite for rows that a hand does not have.
    wrenches : ndarray, shape (B, 6)
        Wrench that each body needs with all limbs at rest.
    moments : ndarray, shape (B, L, P, 3)
        What a limb whose hand is at a placement adds to that wrench's moment.
    reached : ndarray of bool, shape (P, B, L)
        Whether the limb reaches the placement from the body.
    apart : ndarray of bool, shape (P, P)
        Whether hands may be at both placements at once.
    shifts : ndarray of int, shape (E, 2)
        Pairs of bodies between which the body may be shifted, either way.
    start_bodies, goal_bodies : ndarray of bool, shape (B,)
        Bodies at which a climb may begin, and may end.
    start_members, goal_members : ndarray of int, shape (L,)
        Placements of the hands there; −1 for any.
    directions : ndarray, shape (D, 6)
        Directions that states are ruled out with.
    own_members : ndarray of int, shape (N, L)
        Placements (−1: in the air) of states that one more direction rules out, at any body.
    own_directions : ndarray, shape (N, 6)
        That direction.
    route_bodies : ndarray of int, shape (S,)
        Body of each state of the best climb that was found; S = 0 without one.
    route_members : ndarray of int, shape (S, L)
        Its placements; −1 for the limb in the air.
    route_factors : ndarray, shape (S,)
        Its load factors.
    place_poses : ndarray, shape (P, 7)
        Position [m] and quaternion (x, y, z, w) of each placement's hand frame H in W.
    body_poses : ndarray, shape (B, 7)
        Those of the body frame B in W.
    about : ndarray, shape (3,)
        Point about which moments are, in W [m].
    unit : ndarray, shape (6,)
        Unit of wrenches [N, N·m].

    Raises
    ------
    InvalidInputError
        If a shape, an index or a number is not possible; the field is the array's name.
    """

    limbs: tuple[str, ...]
    multiple: float
    backward: bool
    points: Array
    rows: Array
    parts: Indices
    hands: Indices
    base: Array
    room: Array
    wrenches: Array
    moments: Array
    reached: NDArray[np.bool_]
    apart: NDArray[np.bool_]
    shifts: Indices
    start_bodies: NDArray[np.bool_]
    start_members: Indices
    goal_bodies: NDArray[np.bool_]
    goal_members: Indices
    directions: Array
    own_members: Indices
    own_directions: Array
    route_bodies: Indices
    route_members: Indices
    route_factors: Array
    place_poses: Array
    body_poses: Array
    about: Array
    unit: Array

    shapes: ClassVar[Mapping[str, tuple[str, str]]] = {
        **{"points": ("f", "n6"), "rows": ("f", "nk"), "parts": ("i", "q"), "hands": ("i", "h")},
        **{"base": ("f", "P6"), "room": ("f", "Pk"), "wrenches": ("f", "B6")},
        **{"moments": ("f", "BLP3"), "reached": ("b", "PBL"), "apart": ("b", "PP")},
        **{"shifts": ("i", "E2"), "start_bodies": ("b", "B"), "start_members": ("i", "L")},
        **{"goal_bodies": ("b", "B"), "goal_members": ("i", "L"), "directions": ("f", "D6")},
        **{"own_members": ("i", "NL"), "own_directions": ("f", "N6"), "route_bodies": ("i", "S")},
        **{"route_members": ("i", "SL"), "route_factors": ("f", "S"), "place_poses": ("f", "P7")},
        **{"body_poses": ("f", "B7"), "about": ("f", "3"), "unit": ("f", "6")},
    }
    """Kind (float, int, bool) and shape of each array; a letter is a size that arrays share."""
    form: ClassVar = "crux climb certificate"
    version: ClassVar = 1

    def __post_init__(self) -> None:
        kinds = {"f": np.float64, "i": np.intp, "b": np.bool_}
        sizes = {"L": len(self.limbs), **{digit: int(digit) for digit in "23567"}}
        for name, (kind, shape) in self.shapes.items():
            array: NDArray[Any] = np.asarray(getattr(self, name))
            same = array.ndim == len(shape) and array.dtype.kind == kind
            if not same or any(
                sizes.setdefault(letter, size) != size
                for letter, size in zip(shape, array.shape, strict=True)
            ):
                raise InvalidInputError(
                    f"{array.dtype} of shape {array.shape} does not fit the other arrays "
                    f"({shape}); write the certificate again",
                    field=name,
                )
            if kind == "f" and not (np.isfinite(array) | (name == "room") & (array > 0.0)).all():
                raise InvalidInputError("has numbers that are not finite", field=name)
            object.__setattr__(self, name, np.ascontiguousarray(array, dtype=kinds[kind]))
        if not 0.0 <= self.multiple < np.inf:
            raise InvalidInputError(f"must be at least 0, got {self.multiple}", field="multiple")
        ranges = {
            **{"shifts": (0, sizes["B"]), "route_bodies": (0, sizes["B"])},
            **dict.fromkeys(
                ("start_members", "goal_members", "own_members", "route_members"),
                (-1, sizes["P"]),
            ),
        }
        for name, (least, end) in ranges.items():
            array = getattr(self, name)
            if array.size and not least <= array.min() <= array.max() < end:
                raise InvalidInputError(f"must be from {least} to {end - 1}", field=name)
        for name, end in (("parts", sizes["n"]), ("hands", sizes["q"] - 1)):
            array = getattr(self, name)
            rises = len(array) > 0 and array[0] == 0 and array[-1] == end
            # no part and no hand is empty
            if not rises or not (np.diff(array) > 0).all():
                raise InvalidInputError(f"must rise from 0 to {end}", field=name)
        if len(self.hands) != sizes["P"] + 1:
            raise InvalidInputError(f"must have {sizes['P'] + 1} entries", field="hands")

    @property
    def digest(self) -> str:
        """Digest (SHA-256, hexadecimal) of everything that the certificate says."""
        found = sha256(json.dumps(self._header(), sort_keys=True).encode())
        for name in sorted(self.shapes):
            array = getattr(self, name)
            found.update(f"{name} {array.shape}".encode())
            found.update(array.astype(array.dtype.newbyteorder("<")).tobytes())
        return found.hexdigest()

    def _header(self) -> dict[str, Any]:
        return {
            "form": self.form,
            "version": self.version,
            "limbs": list(self.limbs),
            "multiple": self.multiple,
            "backward": self.backward,
        }

    def write(self, target: Path | BinaryIO) -> None:
        """Write the certificate as a file of arrays (NumPy's ``.npz``) with a header in JSON."""
        if isinstance(target, Path):
            with whole_file(target) as part, part.open("wb") as file:
                self.write(file)
            return
        header = json.dumps({**self._header(), "digest": self.digest})
        arrays = {name: getattr(self, name) for name in self.shapes}
        np.savez_compressed(target, allow_pickle=False, header=np.array(header), **arrays)

    @classmethod
    def read(cls, source: Path | bytes) -> Self:
        """Return the certificate that `write` has written, from its file or its bytes.

        Raises
        ------
        InvalidInputError
            If it is none, has another version, or does not agree with its digest.
        """
        if isinstance(source, Path):
            with reading_file(source):
                return cls.read(source.read_bytes())
        try:
            with np.load(BytesIO(source), allow_pickle=False) as arrays:
                header = json.loads(str(arrays["header"]))
                if (header["form"], header["version"]) != (cls.form, cls.version):
                    raise InvalidInputError(
                        f"is no {cls.form} of version {cls.version}; write it again", field="header"
                    )
                found = cls(
                    limbs=tuple(map(str, header["limbs"])),
                    multiple=float(header["multiple"]),
                    backward=bool(header["backward"]),
                    **{name: arrays[name] for name in cls.shapes},
                )
        except (
            ValueError,
            KeyError,
            TypeError,
            AttributeError,
            OSError,
            BadZipFile,
            EOFError,
        ) as error:
            said = f"{type(error).__name__}: {error}"
            raise InvalidInputError(f"is no {cls.form}; write it again ({said})") from None
        if found.digest != header.get("digest"):
            raise InvalidInputError(
                "does not agree with the content: the file was changed; write it again",
                field="digest",
            )
        return found
