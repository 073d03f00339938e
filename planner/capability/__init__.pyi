from .body_space import (
    OTHER_COMPONENTS as OTHER_COMPONENTS,
    WRENCH_COMPONENTS as WRENCH_COMPONENTS,
    BodySection as BodySection,
    BodySpace as BodySpace,
    End as End,
)
from .measurements import (
    MeasurementStudy as MeasurementStudy,
    measured as measured,
    widths as widths,
)
from .polygon import Polygon as Polygon, SupportPoint as SupportPoint, enclose as enclose
from .support_region import (
    ComRegion as ComRegion,
    ComSolid as ComSolid,
    com_region as com_region,
    com_solid as com_solid,
)
from .wrist_survey import Survey as Survey, survey as survey
