from .asked_replies import AskedReplies as AskedReplies
from .chunks import (
    Setting as Setting,
    answer_chunk as answer_chunk,
)
from .columns import (
    Column as Column,
    TableRow as TableRow,
    chosen_columns as chosen_columns,
    climb_columns as climb_columns,
    columns_of as columns_of,
    route_columns as route_columns,
    row_of as row_of,
)
from .evaluation import Question as Question, answer_all as answer_all, answered as answered
from .exports import (
    exporter_at as exporter_at,
    write_csv as write_csv,
)
from .headers import Header as Header, digest_of as digest_of, new_header as new_header
from .lines import Asked as Asked, Lines as Lines
from .pools import (
    LOCAL_CLUSTER as LOCAL_CLUSTER,
    check_address as check_address,
    pool_on as pool_on,
    whole_number as whole_number,
)
from .runs import ReplyLines as ReplyLines, Run as Run, TableLines as TableLines
from .tally import Tally as Tally
from .trajectories import (
    ClimbSummary as ClimbSummary,
    read_climb as read_climb,
    read_climb_summary as read_climb_summary,
    read_trajectory as read_trajectory,
    trajectory_digest as trajectory_digest,
    write_trajectory as write_trajectory,
)
