from .hold_trials import HoldTrials as HoldTrials
from .interruption import (
    Interrupted as Interrupted,
    interruptible as interruptible,
    kill_children as kill_children,
)
from .many import Planners as Planners, plan_many as plan_many, worth as worth
from .questions import Job as Job, answering as answering
from .wall_making import make_wall as make_wall
