from .inverse_kinematics import (
    UnreachableError as UnreachableError,
    solve_limbs as solve_limbs,
    unreachable as unreachable,
)
from .link_tree import LimbTorques as LimbTorques, LinkTree as LinkTree
from .robot import (
    Robot as Robot,
    load_robot as load_robot,
    robosimian as robosimian,
    robot_of as robot_of,
)
from .robot_file import RobotFile as RobotFile
