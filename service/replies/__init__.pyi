from .body_space import (
    Acceleration as Acceleration,
    BodyCapability as BodyCapability,
    BodySection as BodySection,
    BodySpaceReply as BodySpaceReply,
)
from .brief_plan import BriefPlanReply as BriefPlanReply
from .hand import (
    Finger as Finger,
    Hand as Hand,
    Palm as Palm,
    Seating as Seating,
    Tile as Tile,
    Wrist as Wrist,
)
from .health import (
    HealthReply as HealthReply,
    LastFailure as LastFailure,
    ProcessHealth as ProcessHealth,
)
from .limits import LimitName as LimitName, Price as Price
from .plan import (
    Certificate as Certificate,
    PlanReply as PlanReply,
    RobustLoadFactor as RobustLoadFactor,
    Solver as Solver,
    TensionPath as TensionPath,
)
from .reply import (
    AXES as AXES,
    ErrorDetail as ErrorDetail,
    ErrorReply as ErrorReply,
    PlacedFrame as PlacedFrame,
    Reply as Reply,
    StanceReply as StanceReply,
    Time as Time,
)
from .stream import (
    HandColumns as HandColumns,
    HandSetPoints as HandSetPoints,
    SetPointsReply as SetPointsReply,
    StreamReply as StreamReply,
)
from .wrench_set import Generator as Generator, Row as Row, WrenchSet as WrenchSet
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
