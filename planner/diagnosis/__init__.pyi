from .signatures import SlipSignature as SlipSignature, slip_signatures as slip_signatures
from .slip_diagnosis import (
    SlipDiagnosis as SlipDiagnosis,
    SlipFindings as SlipFindings,
    SuspectTile as SuspectTile,
)
