from .slip_diagnosis import (
    SlipDiagnosis as SlipDiagnosis,
    SlipFindings as SlipFindings,
    SuspectTile as SuspectTile,
)
from .signatures import SlipSignature as SlipSignature, slip_signatures as slip_signatures
