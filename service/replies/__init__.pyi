from .climb import (
    CancelReply as CancelReply,
    ClimbFailureReply as ClimbFailureReply,
    ClimbSetPoints as ClimbSetPoints,
    HandKnotReply as HandKnotReply,
    KnotReply as KnotReply,
    PartReply as PartReply,
    SearchProgress as SearchProgress,
)
from .diagnosis import DiagnosisReply as DiagnosisReply, SuspectReply as SuspectReply
from .found_climb import ClimbReply as ClimbReply
from .opening import (
    JamReply as JamReply,
    OpeningKnot as OpeningKnot,
    OpeningReply as OpeningReply,
    TileEventReply as TileEventReply,
)
from .plan import (
    BriefPlanReply as BriefPlanReply,
    CertificateReply as CertificateReply,
    HandReply as HandReply,
    HandSetPoints as HandSetPoints,
    PlanReply as PlanReply,
    RouteReply as RouteReply,
    RouteStageReply as RouteStageReply,
)
from .reply import (
    WRENCH_AXES as WRENCH_AXES,
    ErrorDetail as ErrorDetail,
    ErrorReply as ErrorReply,
    Generator as Generator,
    HealthReply as HealthReply,
    LastFailure as LastFailure,
    PlacedFrame as PlacedFrame,
    ProcessHealth as ProcessHealth,
    RecordingHealth as RecordingHealth,
    Reply as Reply,
    RowReply as RowReply,
    SeatingReply as SeatingReply,
    StanceReply as StanceReply,
    Vector as Vector,
    WrenchSet as WrenchSet,
    Wrist as Wrist,
)
from .set_points import (
    HandColumns as HandColumns,
    PublishedReply as PublishedReply,
    ReleasedFinger as ReleasedFinger,
    SetPointsReply as SetPointsReply,
    StreamReply as StreamReply,
)
from .spaces import (
    Acceleration as Acceleration,
    AxisCapability as AxisCapability,
    BodyCapability as BodyCapability,
    BodySectionReply as BodySectionReply,
    BodySpaceReply as BodySpaceReply,
    ClosingSequenceReply as ClosingSequenceReply,
    ClosingStageReply as ClosingStageReply,
    ComRegionReply as ComRegionReply,
    ComSolidReply as ComSolidReply,
    ContactReply as ContactReply,
    HalfSpaceEquations as HalfSpaceEquations,
    HalfSpacesReply as HalfSpacesReply,
    RobustCapability as RobustCapability,
    TensionLimitReply as TensionLimitReply,
    WrenchSpaceReply as WrenchSpaceReply,
)
