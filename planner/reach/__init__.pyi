from .settings import REACH_SETTINGS as REACH_SETTINGS, ReachSettings as ReachSettings
from .starts import Starts as Starts
from .table import (
    ReachTable as ReachTable,
    reach_poses as reach_poses,
    reach_table as reach_table,
)
from .weights import body_wrenches as body_wrenches, limb_moments as limb_moments
