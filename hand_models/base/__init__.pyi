from .bounded_store import (
    BoundedStore as BoundedStore,
    StoreInfo as StoreInfo,
    enlist as enlist,
    stored as stored,
    stores as stores,
)
from .compiling import (
    compiled as compiled,
    has_compiled as has_compiled,
    record_of as record_of,
)
from .distribution import (
    DISTRIBUTION_NAME as DISTRIBUTION_NAME,
    installed_version as installed_version,
    to_install as to_install,
)
from .errors import (
    CruxError as CruxError,
    EmptySetError as EmptySetError,
    InvalidFieldError as InvalidFieldError,
    InvalidInputError as InvalidInputError,
    LimitError as LimitError,
    RefusedPlaceError as RefusedPlaceError,
    SolverError as SolverError,
    UnsupportedError as UnsupportedError,
    check_positive as check_positive,
    errors_under as errors_under,
    in_file as in_file,
)
from .files import reading_file as reading_file, whole_file as whole_file
from .frames import (
    SKEW_MATRICES as SKEW_MATRICES,
    Array as Array,
    Indices as Indices,
    Pose as Pose,
    finite_vector as finite_vector,
    skew as skew,
    turns_about as turns_about,
    wrench_transport as wrench_transport,
    wrench_transports as wrench_transports,
)
from .long_work import (
    Progress as Progress,
    broken_off_by as broken_off_by,
    go_on as go_on,
    without_collection as without_collection,
)
from .message_fields import (
    Acceleration as Acceleration,
    AccelerationEntry as AccelerationEntry,
    Coordinate as Coordinate,
    Force as Force,
    Mass as Mass,
    Name as Name,
    Position as Position,
    Strict as Strict,
    Tension as Tension,
)
from .one_thread import (
    THREAD_VARIABLES as THREAD_VARIABLES,
    use_one_thread as use_one_thread,
)
from .orientations import (
    ORIENTATION_FIELDS as ORIENTATION_FIELDS,
    check_orientation_form as check_orientation_form,
    oriented_pose as oriented_pose,
)
from .pictures import (
    COLOUR_OF as COLOUR_OF,
    SERIES_COLOURS as SERIES_COLOURS,
    draw_arrow as draw_arrow,
    panel_grid as panel_grid,
    write_picture as write_picture,
)
from .roots import root_between as root_between
from .tolerances import BASE_TOLERANCES as BASE_TOLERANCES, BaseTolerances as BaseTolerances
