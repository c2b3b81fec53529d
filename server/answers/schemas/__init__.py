"""Schemas of the JSON answers, one module for each subject. The OpenAPI document contains the schemas of the JSON
answers, and the routes build answers with these schemas.
"""

from conoid.cases.output.search import Search

from .cases import Gallery, Validation
from .files import Files, Report, SentFile, SentFiles
from .history import EventPage, FragmentCourse, History, Snapshots
from .materials import Materials
from .problems import Problem
from .runs import Receipt, RunPage, RunStatus
from .site import Health, Me
from .sweeps import Reported, Sweep, SweepPage, Wish
from .table import Table

ALL = (
    Problem, Receipt, RunPage, RunStatus, Table, Validation, Gallery, Materials, EventPage, Files, SentFile, SentFiles,
    Snapshots, FragmentCourse, History, Me, Health, Wish, SweepPage, Sweep, Search, Reported,
    Report,
)  # fmt: skip
"""Schemas of complete answers and of requests."""
