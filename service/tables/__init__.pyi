from .body_spaces import (
    print_body_space as print_body_space,
    print_com_region as print_com_region,
)
from .certificates import (
    certificate_json as certificate_json,
    print_certificate as print_certificate,
)
from .command_line import (
    ExitStatus as ExitStatus,
    note as note,
    note_doubts as note_doubts,
    print_oddities as print_oddities,
)
from .extras import (
    print_advice as print_advice,
    print_route_survival as print_route_survival,
    print_survival as print_survival,
    spread_sentences as spread_sentences,
    sure_sentences as sure_sentences,
    words_of as words_of,
)
from .hands import (
    print_robust as print_robust,
    print_survey as print_survey,
    print_wrench_space as print_wrench_space,
    survey_json as survey_json,
)
from .holds import (
    draw_holds as draw_holds,
    hold_json as hold_json,
    print_holds as print_holds,
    refusal_kind as refusal_kind,
    refusals_json as refusals_json,
)
from .layout import (
    VERBOSITY_KEY as VERBOSITY_KEY,
    PrintedColumn as PrintedColumn,
    console as console,
    counted as counted,
    in_order as in_order,
    name as name,
    number as number,
    print_rows as print_rows,
    print_warnings as print_warnings,
    text as text,
    verbosity as verbosity,
)
from .openings import print_opening as print_opening
from .output_lock import fill_alone as fill_alone, write_alone as write_alone
from .plans import print_plan as print_plan, print_route as print_route
from .redundancy import print_redundancy as print_redundancy
from .screening import (
    note_faults as note_faults,
    print_screening as print_screening,
    screening_json as screening_json,
)
from .sweeps import print_sweep as print_sweep
from .terminal import (
    filling_folder as filling_folder,
    progress as progress,
    remark as remark,
    say as say,
    show as show,
    tell_solver as tell_solver,
    waiting as waiting,
    working as working,
    write_answer_page as write_answer_page,
    write_plan_picture as write_plan_picture,
    writing as writing,
)
