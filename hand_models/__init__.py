"""One hand on one hold: what it can carry.

hold + hand parameters → settled finger (q, c) → tile loads as affine maps of tendon tension, or of
  the wrist's motion → WrenchSpace { o + V y : A y ≤ b } and its views.
"""

from hand_models.compliant_hand import CompliantHand
from hand_models.errors import CruxError, EmptySetError, InvalidInputError
from hand_models.fixed_wrist import wrench_space
from hand_models.floating_wrist import FloatingWrist
from hand_models.frames import Pose
from hand_models.hand import FINGERS, Grasp, SettledHand, SpinyHand, spiny_hand
from hand_models.holds import Cylinder, Edge, Ellipsoid, Hold, Plane, Sphere
from hand_models.mesh import Mesh
from hand_models.parallelepiped import tension_limits
from hand_models.profile import Profile
from hand_models.spines import Surface
from hand_models.wrench_space import WrenchSpace

__all__ = [
    "FINGERS",
    "CompliantHand",
    "CruxError",
    "Cylinder",
    "Edge",
    "Ellipsoid",
    "EmptySetError",
    "FloatingWrist",
    "Grasp",
    "Hold",
    "InvalidInputError",
    "Mesh",
    "Plane",
    "Pose",
    "Profile",
    "SettledHand",
    "Sphere",
    "SpinyHand",
    "Surface",
    "WrenchSpace",
    "spiny_hand",
    "tension_limits",
    "wrench_space",
]
