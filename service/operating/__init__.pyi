from .checking import check_endpoints as check_endpoints, check_recording as check_recording
from .moved import (
    note_losses as note_losses,
    print_replay as print_replay,
    replay_json as replay_json,
)
from .options_file import naming_file as naming_file, read_options as read_options
from .stop_signal import StopSignal as StopSignal
from .supervision import supervised as supervised
from .top import (
    Snapshot as Snapshot,
    draw_top as draw_top,
    read_snapshot as read_snapshot,
    top_json as top_json,
)
