from .calls import RosQuestion as RosQuestion
from .names import ros_domain as ros_domain
from .node import RosNode as RosNode, check_node as check_node
