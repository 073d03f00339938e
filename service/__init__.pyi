from .processes import Planners as Planners, plan_many as plan_many
from .requests import (
    BodySpaceRequest as BodySpaceRequest,
    DiagnosisRequest as DiagnosisRequest,
    PlanRequest as PlanRequest,
    SetPointsRequest as SetPointsRequest,
    StreamRequest as StreamRequest,
    WrenchSpaceRequest as WrenchSpaceRequest,
)
from .serving import CruxClient as CruxClient
from .sweeping import Sweep as Sweep, Variation as Variation, sweep as sweep
from .wire import (
    NoServiceError as NoServiceError,
    ServiceError as ServiceError,
    ServiceTimeout as ServiceTimeout,
)
