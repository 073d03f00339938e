from .starting import (
    begin_fork_server as begin_fork_server,
    starting_children as starting_children,
)
from .worker_handles import (
    Make as Make,
    PriorityLane as PriorityLane,
    WorkerHandle as WorkerHandle,
    resident as resident,
    send_part as send_part,
)
from .workers import (
    Lost as Lost,
    Workers as Workers,
    by_index as by_index,
    cores as cores,
)
