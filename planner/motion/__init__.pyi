from .branch import (
    BranchEndError as BranchEndError,
    branches as branches,
    follow_poses as follow_poses,
    pose_between as pose_between,
    shift_postures as shift_postures,
)
from .collisions import (
    CollisionScene as CollisionScene,
    JointSpace as JointSpace,
    NearestPair as NearestPair,
)
from .compiled_capsules import capsule_distances as capsule_distances
from .rocks import Rock as Rock, distances_from_rock as distances_from_rock, rocks_of as rocks_of
from .settings import MOTION_SETTINGS as MOTION_SETTINGS, MotionSettings as MotionSettings
from .shifts import check_shift as check_shift, met_in_shift as met_in_shift
from .swings import (
    NoWayError as NoWayError,
    Swing as Swing,
    clear_branches as clear_branches,
    straight_off as straight_off,
    swing as swing,
)
from .ways import Clear as Clear, check_way as check_way
