"""Data of a run on a server: its state, its files, its messages."""

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
"""Pattern of the id of a run or a sweep, which is also the name of a folder."""
_OF_ONE = {"estimate", "progress", "outcome_json"}
"""Fields of a single run that lists do not have."""


class RunInfo(msgspec.Struct, kw_only=True, frozen=True):
    """A run on a server. Times are Unix s, None before the event."""

    id: Annotated[str, msgspec.Meta(pattern=ID)]
    owner: str
    name: str
    state: State
    ranks: int
    submitted: float
    cause: str | None = None
    message: str = ""
    reason: str = ""
    """Reason for which a queued run waits."""
    started: float | None = None
    finished: float | None = None
    labels: dict[str, str] = {}
    threads: int = 1
    """Threads of each rank."""
    title: str = ""
    short: str = ""
    """Shortest unique prefix of the id; in lists only."""
    estimate: dict[str, Any] = {}
    """The fields from here on are those of a single run; lists do not have these fields (_OF_ONE)."""
    progress: Progress | None = None
    outcome_json: msgspec.Raw = msgspec.field(name="outcome", default=msgspec.Raw(b"null"))

    def _repr_html_(self) -> str:
        """Table for notebooks."""
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
        """The fields of a list, as plain data."""
        return {name: getattr(self, name) for name in self.__struct_fields__ if name not in _OF_ONE}

    @property
    def outcome(self) -> Outcome | None:
        """The outcome; None before the end. Raises ClientError if this client cannot read it."""
        if bytes(self.outcome_json) == b"null":
            return None
        try:
            return outcome_of(bytes(self.outcome_json))
        except msgspec.MsgspecError as error:
            raise ClientError(f"the outcome of run {self.id} cannot be read: {error}") from None


class FileInfo(msgspec.Struct, kw_only=True, frozen=True):
    """A file in a run's folder: its path, its size in bytes, its address. Bytes of a name that are not UTF-8 are
    shown as ``\xff``; only the address has the exact name.
    """

    path: str
    size: int | None = None
    """Size in bytes; None if unknown."""
    url: str = ""


class Listing(msgspec.Struct, kw_only=True, frozen=True):
    """The files of a run's folder."""

    files: list[FileInfo]


class EventPage(msgspec.Struct, kw_only=True, frozen=True):
    """Lines of the journal, the number of the last one, and whether more exist."""

    events: list[msgspec.Raw]
    last: int
    more: bool


class SnapshotPage(msgspec.Struct, kw_only=True, frozen=True):
    """The snapshots of a run."""

    snapshots: list[SnapshotMessage]
