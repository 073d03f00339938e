from . import deadline as deadline
from .advice import HAND_PATH as HAND_PATH, hand_path as hand_path
from .capability import (
    OTHER_COMPONENTS as OTHER_COMPONENTS,
    WRENCH_COMPONENTS as WRENCH_COMPONENTS,
    BodySection as BodySection,
    BodySpace as BodySpace,
    ComRegion as ComRegion,
    ComSolid as ComSolid,
    End as End,
    MeasurementStudy as MeasurementStudy,
    Polygon as Polygon,
    Survey as Survey,
    com_region as com_region,
    com_solid as com_solid,
    survey as survey,
)
from .certification import (
    BoundCheck as BoundCheck,
    ClimbCertificate as ClimbCertificate,
    RouteCheck as RouteCheck,
    check_bound as check_bound,
    check_route as check_route,
)
from .climbs import (
    ClimbProgress as ClimbProgress,
    ClimbStatus as ClimbStatus,
    DecidingStage as DecidingStage,
    FoundClimb as FoundClimb,
    Raise as Raise,
    RefusedMoves as RefusedMoves,
    find_climb as find_climb,
    refuse_limits as refuse_limits,
    weakest_state as weakest_state,
    with_compliant_stages as with_compliant_stages,
    with_compliant_wrists as with_compliant_wrists,
)
from .deadline import (
    DeadlineError as DeadlineError,
)
from .diagnosis import (
    SlipDiagnosis as SlipDiagnosis,
    SlipFindings as SlipFindings,
    SuspectTile as SuspectTile,
)
from .explanation import (
    constraint_words as constraint_words,
)
from .pages import (
    LivePage as LivePage,
    PageTable as PageTable,
    PlaceGroup as PlaceGroup,
    write_climb_page as write_climb_page,
    write_holds_page as write_holds_page,
    write_plan_page as write_plan_page,
    write_route_page as write_route_page,
)
from .pictures import (
    plot_body_space as plot_body_space,
    plot_com_region as plot_com_region,
    plot_opening as plot_opening,
    plot_plan as plot_plan,
    plot_redundancy as plot_redundancy,
    plot_route_survival as plot_route_survival,
    plot_survival as plot_survival,
    plot_wall as plot_wall,
    plot_wrench_space as plot_wrench_space,
    summary as summary,
    write_report as write_report,
)
from .prepare import (
    come_to_rest as come_to_rest,
    floating_wrist as floating_wrist,
    hand_space as hand_space,
    prepare_stance as prepare_stance,
    resting_hand as resting_hand,
    settle_each as settle_each,
)
from .processes import (
    Lost as Lost,
    Make as Make,
    PriorityLane as PriorityLane,
    WorkerHandle as WorkerHandle,
    Workers as Workers,
    begin_fork_server as begin_fork_server,
    cores as cores,
    resident as resident,
    send_part as send_part,
    starting_children as starting_children,
)
from .programs import (
    load_dual_method as load_dual_method,
)
from .question import (
    EARTH_GRAVITY as EARTH_GRAVITY,
    MOVING_WRIST_OBJECTIVES as MOVING_WRIST_OBJECTIVES,
    BodyRange as BodyRange,
    ForceCap as ForceCap,
    HandOnHold as HandOnHold,
    LimbStiffness as LimbStiffness,
    Limits as Limits,
    Load as Load,
    LostTile as LostTile,
    Objective as Objective,
    OpenLoopSettings as OpenLoopSettings,
    Question as Question,
    Stance as Stance,
    SurvivalSettings as SurvivalSettings,
    Want as Want,
    objective_needs as objective_needs,
)
from .recovery import (
    Recovered as Recovered,
    Recovery as Recovery,
    find_redundancy as find_redundancy,
)
from .result import (
    Advice as Advice,
    Certificate as Certificate,
    CertificateOf as CertificateOf,
    Clearance as Clearance,
    Distance as Distance,
    Finding as Finding,
    Finger as Finger,
    HandPlan as HandPlan,
    LimitName as LimitName,
    LoadFactorStatus as LoadFactorStatus,
    Loss as Loss,
    OpenLoop as OpenLoop,
    OpenLoopSample as OpenLoopSample,
    Palm as Palm,
    Plan as Plan,
    Price as Price,
    Quantiles as Quantiles,
    Redundancy as Redundancy,
    Reliability as Reliability,
    RobustLoadFactor as RobustLoadFactor,
    SetPoints as SetPoints,
    Solver as Solver,
    Spread as Spread,
    Survival as Survival,
    SurvivalShare as SurvivalShare,
    TensionPath as TensionPath,
    Time as Time,
    WristPlan as WristPlan,
)
from .robots import (
    Payload as Payload,
    Robot as Robot,
    RobotFile as RobotFile,
    robosimian as robosimian,
    robot_of as robot_of,
)
from .route import (
    Climb as Climb,
    ClimbSettings as ClimbSettings,
    Failure as Failure,
    HandKnot as HandKnot,
    Knot as Knot,
    Move as Move,
    Route as Route,
    RouteResult as RouteResult,
    RouteShare as RouteShare,
    RouteStage as RouteStage,
    RouteSurvival as RouteSurvival,
    StageSurvival as StageSurvival,
    evaluate as evaluate,
    find_route_survival as find_route_survival,
    plan_climb as plan_climb,
    stages as stages,
)
from .screening import Screened as Screened, screen as screen
from .search import (
    Ends as Ends,
    Wall as Wall,
    climb_certificate as climb_certificate,
)
from .simulation import find_survival as find_survival
from .solving import (
    KnownStance as KnownStance,
    PalmLoadFactors as PalmLoadFactors,
    load_factors_without_palm_loads as load_factors_without_palm_loads,
    plan as plan,
    plan_without_palms as plan_without_palms,
    with_advice as with_advice,
)
from .streaming import (
    WrenchStream as WrenchStream,
)
from .walls import (
    BodyGrid as BodyGrid,
    BodyPoses as BodyPoses,
    MadeWall as MadeWall,
    PlaceGrid as PlaceGrid,
    WallProgress as WallProgress,
    WallSource as WallSource,
    finer_about as finer_about,
    read_wall as read_wall,
    wall_digest as wall_digest,
    wall_of as wall_of,
    write_wall as write_wall,
)
