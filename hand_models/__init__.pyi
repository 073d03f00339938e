from .base import (
    CruxError as CruxError,
    EmptySetError as EmptySetError,
    InvalidInputError as InvalidInputError,
    LimitError as LimitError,
    Pose as Pose,
)
from .compliance import CompliantHand as CompliantHand, FloatingWrist as FloatingWrist
from .fixed_wrist import (
    place as place,
    tension_limits as tension_limits,
    wrench_space as wrench_space,
)
from .hand import (
    FINGERS as FINGERS,
    Grasp as Grasp,
    SettledHand as SettledHand,
    SpinyHand as SpinyHand,
    WristTravel as WristTravel,
    spiny_hand as spiny_hand,
)
from .rock import (
    Cylinder as Cylinder,
    Edge as Edge,
    Ellipsoid as Ellipsoid,
    Hold as Hold,
    Mesh as Mesh,
    Plane as Plane,
    Profile as Profile,
    Sphere as Sphere,
)
from .tile import Surface as Surface
from .wrench_spaces import WrenchSpace as WrenchSpace
