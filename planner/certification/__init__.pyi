from .bound_check import BoundCheck as BoundCheck, check_bound as check_bound
from .climb_certificate import ClimbCertificate as ClimbCertificate
from .route_check import RouteCheck as RouteCheck, check_route as check_route
from .settings import (
    CERTIFICATION_SETTINGS as CERTIFICATION_SETTINGS,
    CertificationSettings as CertificationSettings,
)
