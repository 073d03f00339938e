from .hold_trials import RockTrials as RockTrials, try_everywhere as try_everywhere
from .many import Answered as Answered, Planners as Planners, plan_many as plan_many, worth as worth
from .questions import Done as Done, Job as Job, answering as answering
