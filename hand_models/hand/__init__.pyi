from .closed_fingers import (
    closing_is_compiled as closing_is_compiled,
    load_closing as load_closing,
)
from .finger_frames import FingerFrame as FingerFrame
from .grasp import Grasp as Grasp, Placing as Placing, WristTravel as WristTravel
from .model import HandModel as HandModel
from .names import (
    FINGERS as FINGERS,
    FINGERTIP_FORCE as FINGERTIP_FORCE,
    NAIL as NAIL,
    NAIL_SHEAR as NAIL_SHEAR,
)
from .placement import Placement as Placement, PlacementKey as PlacementKey
from .seating import Seating as Seating
from .settled_hand import (
    HandPostures as HandPostures,
    SettledHand as SettledHand,
    SettledPalm as SettledPalm,
    SettledTile as SettledTile,
)
from .settling import seated as seated, settle_hands as settle_hands
from .spinyhand import (
    NearbyClosure as NearbyClosure,
    SpinyHand as SpinyHand,
    nearby_closures as nearby_closures,
    spiny_hand as spiny_hand,
)
from .structure import HELD_DIRECTIONS as HELD_DIRECTIONS
from .tightening import closing_sequence as closing_sequence
