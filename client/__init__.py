"""What a user imports: ``import conoid.client as c; c.connect().submit("taylor_copper").watch()``.

The same words as on the command line: a session validates, submits and lists; a run is watched, cancelled, waited for
and gives its result; a result is viewed.
"""

from conoid.cases.problems import CaseError, ConoidError

from .errors import ClientError, NotFoundError, ServiceError, UnfinishedError, UnreachableError, ViewError
from .found import Found
from .result import Result
from .run import Run
from .session import Session, connect
from .sweep import Sweep
from .told import RunInfo

__all__ = [
    "CaseError", "ClientError", "ConoidError", "Found", "NotFoundError", "Result", "Run", "RunInfo", "ServiceError",
    "Session", "Sweep", "UnfinishedError", "UnreachableError", "ViewError", "connect",
]  # fmt: skip
