from .compliant_finger import COMPLEX_STEP as COMPLEX_STEP, FingerLoads as FingerLoads
from .compliant_hand import CompliantHand as CompliantHand, CompliantHands as CompliantHands
from .compliant_wrist import (
    CompliantWrist as CompliantWrist,
    CompliantWrists as CompliantWrists,
)
from .directional_limit import (
    Farthest as Farthest,
    farthest as farthest,
    linear_extreme as linear_extreme,
    pose_units as pose_units,
)
from .floating_wrist import (
    PALM_MODES as PALM_MODES,
    WRIST_COLUMNS as WRIST_COLUMNS,
    FloatingWrist as FloatingWrist,
    PalmMode as PalmMode,
)
from .grasp import complex_steps as complex_steps, slopes as slopes
from .grid_search import (
    PLANAR_COMPONENTS as PLANAR_COMPONENTS,
    WristSearch as WristSearch,
    boundary as boundary,
    search_grid as search_grid,
)
from .gripper import (
    GRIPPER_SIDES as GRIPPER_SIDES,
    Gripper as Gripper,
    gripper_table as gripper_table,
    pulled_off as pulled_off,
    sandpaper as sandpaper,
)
from .inverse import WristPose as WristPose, wrist_pose as wrist_pose
from .linear_pieces import pieces as pieces
from .link import Numbers as Numbers
from .pose_box import linear_box as linear_box, search_box as search_box
