from .closed_finger import (
    ClosedFinger as ClosedFinger,
    Refused as Refused,
    cling as cling,
    close_all as close_all,
    lay_across as lay_across,
    straight_lift as straight_lift,
)
from .closure_loads import stays as stays, tendon_loads as tendon_loads
from .finger_path import (
    FingerPath as FingerPath,
    closing_paths as closing_paths,
    opening_paths as opening_paths,
)
from .fingernail import Fingernail as Fingernail
from .model import PHALANGES as PHALANGES, FingerModel as FingerModel
from .path_state import OpenFinger as OpenFinger
from .phalanx_shape import middle_of_bed as middle_of_bed
from .sequential_closure import (
    CONTACT_KINDS as CONTACT_KINDS,
    ClosedPhalanx as ClosedPhalanx,
    SequentialClosure as SequentialClosure,
    settle_finger as settle_finger,
)
from .settled_finger import (
    JOINT_STOPS as JOINT_STOPS,
    Contact as Contact,
    SettledFinger as SettledFinger,
)
