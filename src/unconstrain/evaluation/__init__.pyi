"""What the room offers; each is imported on first use, as verdicts need no learner."""

from . import diagnosis as diagnosis
from . import metrics as metrics
from . import verdicts as verdicts
from .diagnosis import Diagnosis as Diagnosis
from .diagnosis import diagnose as diagnose
from .metrics import cpe as cpe
from .metrics import inconsistency as inconsistency
from .metrics import ncpe as ncpe
from .metrics import ninconsistency as ninconsistency
from .metrics import nnpe as nnpe
from .metrics import npoe as npoe
from .metrics import nppe as nppe
from .metrics import nupe as nupe
from .metrics import upe as upe
