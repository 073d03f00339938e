from .drive import TendonDrive as TendonDrive
from .finger_tendon import (
    FingerTendon as FingerTendon,
    TendonBatch as TendonBatch,
    TendonState as TendonState,
    pad_tiles as pad_tiles,
)
from .load_sharing import (
    check_palm as check_palm,
    share_load as share_load,
    shear_capacity as shear_capacity,
    shear_stiffness as shear_stiffness,
)
from .regimes import MotorScheme as MotorScheme, TendonRegimes as TendonRegimes
