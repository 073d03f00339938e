"""Numbers of one finger, the same for the four fingers of a hand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import ParameterTable, check_widths, scan_table
from hand_models.sections import FingerSize

__all__ = ["PHALANGES", "FingerModel"]

PHALANGES = ("proximal", "middle", "distal")


@dataclass(frozen=True)
class FingerModel:
    """Geometry, springs and friction of a finger; the four fingers are alike. SI units.

    Attributes
    ----------
    joint_spacing : float
        Distance from a joint to the next [m].
    tile_height, tile_centre, tile_length : float
        Height of the tile's face above the joint's axis, distance of the tile's centre from the
        joint along the phalanx, length of the tile [m].
    tile_width, frame_width : float
        Widths of the tile and of the phalanx's frame, across the finger [m].
    pulley_radii, joint_stiffness, joint_preload : tuple of float, length 3
        Pulley radius r [m], spring stiffness K [N·m/rad] and spring preload p [N·m] of each joint.
    joint_lower, joint_upper : tuple of float, length 3
        Limits of each joint's angle, relative to the phalanx before it [rad].
    engagement : tuple of float, length 3
        τ, shear of each tile over closing tension at the moment of closing.
    base_engagement : float
        τ of the tile on a rotating base.
    shear_gain : tuple of float, length 3
        g = c_p k_c / (k_c + K_p) of each tile, shear per newton of further tension (c_p strands of
        tendon, contact stiffness k_c, spring K_p); a tile on a rotating base has the proximal g.
    spine_travel : float
        Distance that spines reach out of their tile [m].
    engagement_exponent : float
        p, exponent of the law of engagement (`engaged_share`).
    least_share : float
        φ₀, share of a tile's spines from which on it bears its joint alone (`Contact`).
    frame_radius : float
        Radius of the bare phalanx about the line of its joints [m].
    bed_stiffness : float
        Stiffness of the bed of springs under a tile, per tile [N/m].
    friction : float
        μ of the tendon between phalanges, in M = diag(1, 1 − μ, (1 − μ)², …) (Eq. 8).
    """

    joint_spacing: float
    tile_height: float
    tile_centre: float
    tile_length: float
    tile_width: float
    frame_width: float
    pulley_radii: tuple[float, ...]
    joint_stiffness: tuple[float, ...]
    joint_preload: tuple[float, ...]
    joint_lower: tuple[float, ...]
    joint_upper: tuple[float, ...]
    engagement: tuple[float, ...]
    base_engagement: float
    shear_gain: tuple[float, ...]
    spine_travel: float
    engagement_exponent: float
    least_share: float
    frame_radius: float
    bed_stiffness: float
    friction: float

    @classmethod
    def from_table(cls, table: ParameterTable) -> FingerModel:
        """Read the finger's numbers from a table of ``hand.toml``.

        Raises
        ------
        InvalidInputError
            If a number is missing or impossible.
        """
        contact = np.array(table.vector("tile", "contact_stiffness"))
        spring = table.scalar("tile", "spring_stiffness")
        pulleys = table.positive("tile", "pulley_ratio")
        model = cls(
            joint_spacing=table.positive("finger", "joint_spacing"),
            tile_height=table.scalar("finger", "tile_height"),
            tile_centre=table.scalar("finger", "tile_centre"),
            tile_length=table.positive("finger", "tile_length"),
            tile_width=table.scalar("finger", "tile_width"),
            frame_width=table.scalar("finger", "frame_width"),
            pulley_radii=table.vector("finger", "pulley_radii"),
            joint_stiffness=table.vector("finger", "joint_stiffness"),
            joint_preload=table.vector("finger", "joint_preload"),
            joint_lower=table.vector("finger", "joint_lower"),
            joint_upper=table.vector("finger", "joint_upper"),
            engagement=table.vector("tile", "engagement"),
            base_engagement=table.scalar("tile", "base_engagement"),
            shear_gain=tuple((pulleys * contact / (contact + spring)).tolist()),
            spine_travel=table.scalar("tile", "spine_travel"),
            engagement_exponent=table.positive("tile", "engagement_exponent"),
            least_share=table.positive("tile", "least_share"),
            frame_radius=table.positive("finger", "frame_radius"),
            bed_stiffness=table.positive("tile", "bed_stiffness"),
            friction=table.scalar("tendon", "friction"),
        )
        for section, name in (
            ("finger", "pulley_radii"),
            ("finger", "joint_stiffness"),
            ("finger", "joint_preload"),
            ("finger", "joint_lower"),
            ("finger", "joint_upper"),
            ("tile", "engagement"),
            ("tile", "contact_stiffness"),
        ):
            count, size = len(PHALANGES), len(table.vector(section, name))
            if size != count:
                raise InvalidInputError(
                    f"{count} numbers are needed, got {size}", field=f"{section}.{name}"
                )
        if not 0.0 <= model.friction < 1.0:
            raise InvalidInputError(
                f"must be in [0, 1), got {model.friction:g}", field="tendon.friction"
            )
        if model.least_share > 1.0:
            raise InvalidInputError(
                f"must be in (0, 1], got {model.least_share:g}", field="tile.least_share"
            )
        if not contact.min() > 0.0:
            raise InvalidInputError(
                f"must be above 0 N/m, got {contact.tolist()}", field="tile.contact_stiffness"
            )
        if not min(model.pulley_radii) > 0.0:
            raise InvalidInputError(
                f"must be above 0 m, got {list(model.pulley_radii)}", field="finger.pulley_radii"
            )
        begin, end = model.tile_range
        if not 0.0 <= begin < end <= model.joint_spacing:
            raise InvalidInputError(
                f"a tile must lie on its phalanx, from 0 to {model.joint_spacing:g} m, "
                f"got {begin:g} to {end:g} m (tile_centre ± tile_length / 2)",
                field="finger.tile_centre",
            )
        check_widths(table)
        for lower, upper in zip(model.joint_lower, model.joint_upper, strict=True):
            if not -math.pi <= lower < upper <= math.pi:
                raise InvalidInputError(
                    "must be above finger.joint_lower, both within half a turn, "
                    f"got {upper:g} over {lower:g} rad",
                    field="finger.joint_upper",
                )
        return model

    @property
    def reach(self) -> float:
        """Largest distance from the proximal joint at which a finger may touch anything [m]."""
        return len(self.pulley_radii) * self.joint_spacing + self.tile_height

    @property
    def size(self) -> FingerSize:
        """Sizes that say which rock the finger meets, with a tile's length beyond its reach."""
        strip = scan_table().scalar("cut", "strip")
        reach = self.reach + self.tile_length
        return FingerSize(reach, self.tile_width, self.frame_width, strip)

    @property
    def tile_range(self) -> tuple[float, float]:
        """Begin and end of a tile's face, as distances along the phalanx from its joint [m]."""
        half = self.tile_length / 2.0
        return self.tile_centre - half, self.tile_centre + half

    def depths(self, base_tile: bool) -> Array:
        """Return how far the tendon presses each tile into its bed of springs.

        The tendon's normal force is taken to act at the tiles' centres.

        Parameters
        ----------
        base_tile : bool
            Whether a base tile comes first on the tendon.

        Returns
        -------
        ndarray, shape (3,)
            Depth of each phalanx's tile per newton of tension, proximal first [m/N].
        """
        pull = self.losses(base_tile) * np.asarray(self.pulley_radii)
        return np.asarray(pull / (self.tile_centre * self.bed_stiffness))

    def losses(self, base_tile: bool) -> Array:
        """Return M, each phalanx's tendon tension over the motor's (diagonal of Eq. 8), shape (3,).

        ``base_tile``: whether a base tile comes first on the tendon (one more factor 1 − μ).
        """
        first = 1 if base_tile else 0
        return np.asarray((1.0 - self.friction) ** np.arange(first, first + 3))
