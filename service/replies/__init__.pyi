from .body_space import (
    Acceleration as Acceleration,
    BodyCapability as BodyCapability,
    BodySection as BodySection,
    BodySpaceReply as BodySpaceReply,
)
from .hand import (
    Generator as Generator,
    Hand as Hand,
    Palm as Palm,
    Row as Row,
    Seating as Seating,
    WrenchSet as WrenchSet,
    Wrist as Wrist,
)
from .plan import (
    BriefPlanReply as BriefPlanReply,
    Certificate as Certificate,
    PlanReply as PlanReply,
)
from .reply import (
    AXES as AXES,
    ErrorDetail as ErrorDetail,
    ErrorReply as ErrorReply,
    HealthReply as HealthReply,
    LastFailure as LastFailure,
    PlacedFrame as PlacedFrame,
    ProcessHealth as ProcessHealth,
    Reply as Reply,
    StanceReply as StanceReply,
    Vector as Vector,
)
from .route import RouteReply as RouteReply, RouteStage as RouteStage
from .stream import (
    HandColumns as HandColumns,
    HandSetPoints as HandSetPoints,
    SetPointsReply as SetPointsReply,
    StreamReply as StreamReply,
)
from .wrench_space import (
    AxisCapability as AxisCapability,
    ClosingSequence as ClosingSequence,
    ClosingStage as ClosingStage,
    Contact as Contact,
    HalfSpaceEquations as HalfSpaceEquations,
    HalfSpaces as HalfSpaces,
    RobustCapability as RobustCapability,
    TensionLimit as TensionLimit,
    WrenchSpaceReply as WrenchSpaceReply,
)
