from .drive import TendonDrive as TendonDrive
from .finger_tendon import FingerTendon as FingerTendon
from .finger_tendon import TendonState as TendonState
from .load_sharing import PalmTendon as PalmTendon
from .load_sharing import share_load as share_load
from .load_sharing import shear_capacity as shear_capacity
from .regimes import MotorScheme as MotorScheme
from .regimes import TendonRegimes as TendonRegimes
