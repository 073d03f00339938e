from .advice import Advice as Advice, AdviceKind as AdviceKind
from .certificate import CertificateOf as CertificateOf
from .hand_plan import HandPlan as HandPlan, PlanArrays as PlanArrays, WristPlan as WristPlan
from .load_recovery import (
    LoadRecovery as LoadRecovery,
    recover_floating_hand as recover_floating_hand,
)
from .open_loop import OpenLoop as OpenLoop, OpenLoopSample as OpenLoopSample
from .plain_parts import (
    Clearance as Clearance,
    Distance as Distance,
    Finding as Finding,
    Finger as Finger,
    LimitName as LimitName,
    LoadFactor as LoadFactor,
    LoadFactorStatus as LoadFactorStatus,
    Palm as Palm,
    Price as Price,
    Solver as Solver,
    TensionPath as TensionPath,
    Tile as Tile,
    Time as Time,
)
from .plan import (
    Certificate as Certificate,
    Plan as Plan,
    SetPoints as SetPoints,
    SetPointSource as SetPointSource,
    Status as Status,
)
from .robust_load_factor import (
    RobustLoadFactor as RobustLoadFactor,
    RobustQuantiles as RobustQuantiles,
)
from .spread import (
    SPREAD_SETTINGS as SPREAD_SETTINGS,
    DrawnPlan as DrawnPlan,
    Influence as Influence,
    Quantiles as Quantiles,
    SentPlan as SentPlan,
    SentSpread as SentSpread,
    Spread as Spread,
    StrengthThreshold as StrengthThreshold,
)
