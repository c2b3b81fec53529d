"""A run on a server: status, wait, watch, cancel, events, files, download, result."""

import math
import shutil
import tempfile
import time
import weakref
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.figures import duration
from conoid.cases.messages import AnyMessage
from conoid.cases.messages import Snapshot as SnapshotMessage
from conoid.cases.output import keys

from .errors import ClientError, NotFoundError, ServiceError, UnfinishedError, UnreachableError, passes
from .live import Live
from .local.safe_paths import inside, quoted
from .remote.http import Http
from .remote.link import Link
from .remote.run_info import EventPage, FileInfo, Listing, RunInfo, SnapshotPage
from .result import Result
from .snapshots import Snapshot

_WAIT = 20.0
"""Time limit of one request that waits for the end of a run, s. This limit is below the 30 s after which a request is
given up (http.py)."""
_PATIENCE = 120.0
"""Time without an answer of the server, s, after which waiting for a run ends (chosen value: twice the time of a
restart)."""


@dataclass
class Run:
    """A run on a server. Only the methods send requests."""

    session: Http
    id: str

    def _repr_html_(self) -> str:
        """Status of the run as HTML, for notebooks."""
        return self.status()._repr_html_()

    # State ------------------------------------------------------------------------------------------------------------

    @property
    def path(self) -> str:
        """Path of the run in the REST interface."""
        return f"/v1/runs/{quoted(self.id)}"

    def status(self) -> RunInfo:
        """Returns the present status of the run."""
        return self.session.get(RunInfo, self.path)

    def wait(self, timeout: float | None = None) -> RunInfo:
        """Waits for the end of the run. Raises TimeoutError after ``timeout`` s. If the server does not answer or is
        too busy, the request is repeated for two minutes.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        received = time.monotonic()
        while True:
            left = max(0.0, min(_WAIT, deadline - time.monotonic()))
            try:
                info = self.session.get(RunInfo, self.path, wait=left)
            except (UnreachableError, ServiceError) as error:
                if not passes(error) or time.monotonic() - received > _PATIENCE:
                    raise
                if time.monotonic() >= deadline:
                    raise TimeoutError(f"run {self.id}: {error}") from None
                time.sleep(min(1.0, left))
                continue
            received = time.monotonic()
            if info.state.final:
                return info
            if received >= deadline:
                raise TimeoutError(f"run {self.id} is still {info.state.value} after {duration(timeout)}")

    def cancel(self) -> RunInfo:
        """Cancels the run; repeated calls have no effect."""
        return self.session.post(RunInfo, f"{self.path}:cancel")

    def purge(self) -> None:
        """Removes a run that has ended, with all its files, from the server. A removal cannot be undone."""
        self.session.delete(self.path)

    def checkpoint(self) -> RunInfo:
        """Requests a checkpoint. When the checkpoint is on disk, a ``Checkpoint`` message reports it."""
        return self.session.post(RunInfo, f"{self.path}:checkpoint")

    def take_snapshot(self) -> RunInfo:
        """Requests a snapshot of the fragments. When the snapshot is on disk, a ``Snapshot`` message reports it."""
        return self.session.post(RunInfo, f"{self.path}:snapshot")

    # Messages ---------------------------------------------------------------------------------------------------------

    def events(self, after: int = 0) -> list[AnyMessage]:
        """Returns the messages of the journal whose number is above ``after``."""
        found: list[AnyMessage] = []
        while True:
            page = self.session.get(EventPage, f"{self.path}/events", after=after)
            found += [self.session.line(event) for event in page.events]
            if not page.more:
                return found
            if page.last <= after:
                raise self.session.endless("messages")
            after = page.last

    def messages(self, after: int = 0, link: Link | None = None) -> Generator[AnyMessage]:
        """Yields every message with a number above ``after`` once and in order, until the end of the run.

        Messages come over Zenoh if the router can be reached, else over SSE; ``link`` selects one of both.
        """
        from .remote.stream import follow  # Loaded only if needed, because zenoh loads slowly.

        return follow(link or self.link(), self.events, lambda: self.status().state.final, after)

    def link(self) -> Link:
        """Opens a subscription to the messages of the run: over Zenoh if the router can be reached, else over SSE."""
        from .remote.stream import SseLink, StreamError, ZenohLink  # Loaded only if needed, because zenoh loads slowly.

        me = self.session.me()
        if me.zenoh is not None:
            with suppress(StreamError):
                return ZenohLink(me.zenoh, keys.run_prefix(me.owner, self.id))
        return SseLink(lambda: self.session.stream(f"{self.path}/stream"))

    def watch(self, live: bool | None = None) -> Live:
        """Shows the run in the terminal until it ends. ``live``: True for the panel, False for plain text lines,
        None to choose by the terminal.
        """
        from .watch import watch  # Loaded only if needed, because rich loads slowly.

        return watch(self, live)

    def history(self, points: int = 1000) -> dict[str, Any]:
        """Returns the history of the run with at most ``points`` reports. The keys of the history are ``series``,
        ``ranks``, ``balance``, ``snapshots``, ``last``.
        """
        return self.session.get(dict[str, Any], f"{self.path}/history", points=points)

    # Snapshots --------------------------------------------------------------------------------------------------------

    def snapshots(self) -> list[SnapshotMessage]:
        """Returns the messages of the journal about snapshots of the fragments."""
        return self.session.get(SnapshotPage, f"{self.path}/snapshots").snapshots

    def snapshot(self, n: int = -1) -> Snapshot:
        """Returns the snapshot with the number ``n``; -1 means the newest. Raises UnfinishedError if the snapshot
        does not exist.
        """
        number = n if n >= 0 else max((message.n for message in self.snapshots()), default=0)
        try:
            return Snapshot(self.session.fetch(f"{self.path}/snapshots/{number}"))
        except NotFoundError:
            raise self._lacks(f"snapshot {number}") from None

    def fragments(self, after: int = 0, link: Link | None = None) -> Generator[Snapshot]:
        """Yields every snapshot whose message has a number above ``after``, until the end of the run.

        Over Zenoh the data comes with the message; missing data is read from the server.
        """
        chosen = link or self.link()
        for message in self.messages(after, chosen):
            if isinstance(message, SnapshotMessage):
                data = getattr(chosen, "blobs", {}).get(message.sha256)
                yield Snapshot(data) if data else self.snapshot(message.n)

    # Files ------------------------------------------------------------------------------------------------------------

    def files(self) -> list[FileInfo]:
        """Lists the files in the folder of the run."""
        return self.session.get(Listing, f"{self.path}/files").files

    def download(self, folder: Path | str, name: str | None = None) -> Path:
        """Copies one file, or all files, into ``folder``. Returns the path of the file, or the folder. Raises
        AnswerError if the run has ended and the size of a file differs from the list.
        """
        root = Path(folder)
        if name is not None:
            return self.fetch(root, FileInfo(path=name))
        final = self.over()
        for file in self.files():
            self.fetch(root, file, final)
        return root

    def over(self) -> bool:
        """Returns True if the run has ended, so that its files no longer change."""
        return self.status().state.final

    def fetch(self, folder: Path, file: FileInfo, final: bool = False) -> Path:
        """Copies a listed file into ``folder`` and returns its path. If the run has ended (``final``), the size of
        the copy must be the listed size.
        """
        target = inside(folder, file.path)
        try:
            self.session.download(self._address(file), target, file.size if final else None)
        except NotFoundError:
            raise self._lacks(file.path) from None
        return target

    def _address(self, file: FileInfo) -> str:
        """Returns the address of a file. The address is that in the list if it belongs to the run; else the address is
        made from the path.
        """
        own = f"{self.path}/files/"
        return file.url if file.url.startswith(own) else f"{own}{quoted(file.path, safe='/')}"

    def _lacks(self, what: str) -> ClientError:
        """Returns the error for a file that the run has not written, or for an unknown run."""
        try:
            self.status()
        except NotFoundError as error:
            return error
        return UnfinishedError(f"run {self.id} has no {what}")

    def result(self) -> Result:
        """The result of the run. Files are copied from the server at their first use, and kept until the result is
        deleted.
        """
        return Result(RemoteFolder(self))


class RemoteFolder:
    """The folder of a run on a server. Each file is copied once into a temporary folder, which is removed with this
    object.
    """

    def __init__(self, run: Run) -> None:
        """Stores the run; no file is copied yet."""
        self.run = run
        self.root = Path(tempfile.mkdtemp(prefix="conoid-"))
        weakref.finalize(self, shutil.rmtree, self.root, ignore_errors=True)

    @property
    def name(self) -> str:
        """Id of the run."""
        return self.run.id

    def names(self) -> list[str]:
        """Lists all files of the run; names are relative to the folder."""
        return [file.path for file in self.run.files()]

    def path(self, name: str) -> Path:
        """Returns the path of a local copy of a file."""
        target = inside(self.root, name)
        return target if target.is_file() else self.run.download(self.root, name)

    def named(self, name: str) -> str:
        """Returns the name of a file with its run and server, because the local copy is temporary."""
        return f"{name} of run {self.run.id} at {self.run.session.url}"
