from .workers import (
    Lost as Lost,
    Worker as Worker,
    Workers as Workers,
    cores as cores,
    one_thread as one_thread,
)
