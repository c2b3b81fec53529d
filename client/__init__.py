"""The Python client: ``import conoid.client as c; c.connect().submit("taylor_copper").watch()``.

The methods of the client have the names of the commands: a session can validate, submit and list. A run can be
watched, cancelled and waited for, and has a result; a result can be viewed.
"""

from conoid.cases.reading.problems import CaseError, ConoidError

from .errors import ClientError, NotFoundError, ServiceError, UnfinishedError, UnreachableError, ViewError
from .local.own_server import LocalServer
from .remote.run_info import RunInfo
from .remote.session import Session, connect
from .result import Result
from .run import Run
from .sweeps.adaptive_result import Found
from .sweeps.sweep import Sweep

__all__ = [
    "CaseError", "ClientError", "ConoidError", "Found", "LocalServer", "NotFoundError", "Result", "Run", "RunInfo",
    "ServiceError", "Session", "Sweep", "UnfinishedError", "UnreachableError", "ViewError", "connect",
]  # fmt: skip
