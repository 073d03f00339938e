from .build import ROOT_JOINT as ROOT_JOINT
from .capsules import Capsules as Capsules, scene_number as scene_number
from .inverse_kinematics import (
    UnreachableError as UnreachableError,
    solve_limbs as solve_limbs,
)
from .limb_batch import LimbBatch as LimbBatch
from .link_tree import LimbTorques as LimbTorques, LinkTree as LinkTree
from .payload import (
    Payload as Payload,
    carriers as carriers,
    check_carrier as check_carrier,
    held_up as held_up,
)
from .pose_search import damped_step as damped_step, postures_near as postures_near
from .robot import (
    Robot as Robot,
    robosimian as robosimian,
    robot_of as robot_of,
)
from .robot_file import RobotFile as RobotFile
from .tolerances import TOLERANCES as TOLERANCES
from .visuals import (
    LinkMesh as LinkMesh,
    joint_poses as joint_poses,
    link_meshes as link_meshes,
)
