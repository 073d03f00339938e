from .many import Answered as Answered
from .many import Planners as Planners
from .many import plan_many as plan_many
from .many import worth as worth
