from .child_processes import begin_child as begin_child, spawned as spawned
from .workers import (
    Lost as Lost,
    Worker as Worker,
    Workers as Workers,
    cores as cores,
)
