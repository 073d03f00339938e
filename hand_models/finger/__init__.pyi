from .closure import intrusion as intrusion, settle_finger as settle_finger
from .closure_loads import ClosureLoads as ClosureLoads, TendonLoads as TendonLoads, stays as stays
from .contact_states import (
    ClosedFinger as ClosedFinger,
    OpenFinger as OpenFinger,
    cling as cling,
    close_all as close_all,
)
from .fingernail import Fingernail as Fingernail
from .model import (
    PHALANGES as PHALANGES,
    Contact as Contact,
    FingerModel as FingerModel,
    SettledFinger as SettledFinger,
)
from .postures import FREE as FREE, STOPS as STOPS
from .sequential_closure import (
    EDGE as EDGE,
    FACE as FACE,
    KINDS as KINDS,
    NONE as NONE,
    ClosedPhalanx as ClosedPhalanx,
    SequentialClosure as SequentialClosure,
)
