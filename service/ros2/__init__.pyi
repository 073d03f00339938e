from .calls import RosCall as RosCall
from .names import ros_domain as ros_domain
from .node import RosNode as RosNode
