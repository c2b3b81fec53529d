"""Data of a run on a server: state, files, messages."""

from html import escape
from typing import Annotated, Any

import msgspec

from conoid.cases.messages import Progress
from conoid.cases.messages import Snapshot as SnapshotMessage
from conoid.cases.outcome import Outcome
from conoid.cases.run import State

from ..errors import ClientError
from ..result import outcome_of

ID = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\Z"
"""Pattern of the id of a run or a sweep; the id is also the name of a folder."""
_OF_ONE = {"estimate", "progress", "outcome_json"}
"""Fields that only a single run has; runs in lists do not have these fields."""


class RunInfo(msgspec.Struct, kw_only=True, frozen=True):
    """A run on a server. Times are Unix s; a time is None before its event."""

    id: Annotated[str, msgspec.Meta(pattern=ID)]
    owner: str
    name: str
    state: State
    ranks: int
    submitted: float
    cause: str | None = None
    message: str = ""
    reason: str = ""
    """Reason why a queued run waits."""
    started: float | None = None
    finished: float | None = None
    labels: dict[str, str] = {}
    threads: int = 1
    """Number of threads of each rank."""
    title: str = ""
    short: str = ""
    """Shortest unique prefix of the id; only runs in lists have it."""
    estimate: dict[str, Any] = {}
    """Estimate of the needs of the run. Runs in lists have neither ``estimate`` nor the fields below it (_OF_ONE)."""
    progress: Progress | None = None
    outcome_json: msgspec.Raw = msgspec.field(name="outcome", default=msgspec.Raw(b"null"))

    def _repr_html_(self) -> str:
        """The run as an HTML table, for notebooks."""
        labels = ", ".join(f"{name}={value}" for name, value in self.labels.items())
        rows = {
            "run": self.id,
            "case": self.title or self.name,
            "state": self.state.value,
            "why": self.message,
            "labels": labels,
        }
        lines = (f"<tr><th>{name}</th><td>{escape(text)}</td></tr>" for name, text in rows.items() if text)
        return f"<table>{''.join(lines)}</table>"

    @property
    def listed(self) -> dict[str, Any]:
        """The fields that a run in a list has, as plain data."""
        return {name: getattr(self, name) for name in self.__struct_fields__ if name not in _OF_ONE}

    @property
    def outcome(self) -> Outcome | None:
        """The outcome of the run; None before its end. Raises ClientError if this client cannot read the outcome."""
        if bytes(self.outcome_json) == b"null":
            return None
        try:
            return outcome_of(bytes(self.outcome_json))
        except msgspec.MsgspecError as error:
            raise ClientError(f"the outcome of run {self.id} cannot be read: {error}") from None


class FileInfo(msgspec.Struct, kw_only=True, frozen=True):
    """A file in the folder of a run: path, size in bytes, address. Bytes of a name that are not UTF-8 are shown as
    ``ÿ``; only the address contains the exact name.
    """

    path: str
    size: int | None = None
    """Size in bytes; None if unknown."""
    url: str = ""


class Listing(msgspec.Struct, kw_only=True, frozen=True):
    """The files in the folder of a run."""

    files: list[FileInfo]


class EventPage(msgspec.Struct, kw_only=True, frozen=True):
    """Messages of the journal, the number of the last message, and whether there are more messages."""

    events: list[msgspec.Raw]
    last: int
    more: bool


class SnapshotPage(msgspec.Struct, kw_only=True, frozen=True):
    """The snapshots of a run."""

    snapshots: list[SnapshotMessage]
