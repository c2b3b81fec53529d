"""What a server tells of a run: its state, its files, its messages, as plain data."""

from html import escape
from typing import Annotated, Any

import msgspec

from conoid.cases.messages import Progress
from conoid.cases.messages import Snapshot as Told
from conoid.cases.outcome import Outcome
from conoid.cases.run import State

from ..errors import ClientError
from ..result import outcome_of

ID = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\Z"
"""Of a run or a sweep: a name of a folder, too."""
_OF_ONE = {"estimate", "progress", "outcome_json"}
"""What is told of one run, not in a list."""


class RunInfo(msgspec.Struct, kw_only=True, frozen=True):
    """What the server tells of a run. Times are Unix s, None when they have not come yet."""

    id: Annotated[str, msgspec.Meta(pattern=ID)]
    owner: str
    name: str
    state: State
    ranks: int
    submitted: float
    cause: str | None = None
    message: str = ""
    reason: str = ""
    """What a queued run waits for."""
    started: float | None = None
    finished: float | None = None
    labels: dict[str, str] = {}
    threads: int = 1
    """Of each rank."""
    title: str = ""
    short: str = ""
    """The beginning of the id that no other run has; told in lists alone."""
    estimate: dict[str, Any] = {}
    """This and what follows is told of one run, not in a list (_OF_ONE)."""
    progress: Progress | None = None
    outcome_json: msgspec.Raw = msgspec.field(name="outcome", default=msgspec.Raw(b"null"))

    def _repr_html_(self) -> str:
        """For notebooks."""
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
        """What a list tells of it, as plain data."""
        return {name: getattr(self, name) for name in self.__struct_fields__ if name not in _OF_ONE}

    @property
    def outcome(self) -> Outcome | None:
        """How it ended; None before its end. Raises ClientError when this client cannot read it."""
        if bytes(self.outcome_json) == b"null":
            return None
        try:
            return outcome_of(bytes(self.outcome_json))
        except msgspec.MsgspecError as error:
            raise ClientError(f"the outcome of run {self.id} cannot be read: {error}") from None


class FileInfo(msgspec.Struct, kw_only=True, frozen=True):
    """A file in a run's folder: its path there, its bytes, and where it is fetched. Bytes of a name that are no UTF-8
    are shown as ``\\xff``: the address alone has them.
    """

    path: str
    size: int | None = None
    """None where it is not known."""
    url: str = ""


class Listing(msgspec.Struct, kw_only=True, frozen=True):
    """What lies in a run's folder."""

    files: list[FileInfo]


class EventPage(msgspec.Struct, kw_only=True, frozen=True):
    """Journal lines, the number of the last one, and whether there are more."""

    events: list[msgspec.Raw]
    last: int
    more: bool


class SnapshotPage(msgspec.Struct, kw_only=True, frozen=True):
    """The snapshots of a run."""

    snapshots: list[Told]
