"""A handle of a run on a server: status, wait, watch, cancel, events, files, download, result."""

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
from conoid.cases.messages import Snapshot as Told
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
"""s of a single request that waits for the end of a run: below the 30 s after which a request is given up (http.py)."""
_PATIENCE = 120.0
"""s that a server may be away while the end of a run is waited for. Chosen: time for a restart, twice over."""


@dataclass
class Run:
    """A run on a server. Nothing is asked before a method is called."""

    session: Http
    id: str

    def _repr_html_(self) -> str:
        """Its status, for notebooks."""
        return self.status()._repr_html_()

    # State ------------------------------------------------------------------------------------------------------------

    @property
    def path(self) -> str:
        """Its place in the REST interface."""
        return f"/v1/runs/{quoted(self.id)}"

    def status(self) -> RunInfo:
        """What the server knows of it now."""
        return self.session.get(RunInfo, self.path)

    def wait(self, timeout: float | None = None) -> RunInfo:
        """Returns when the run has ended. Raises TimeoutError after ``timeout`` s.

        A server that is away, or too busy to answer, is waited for, two minutes long.
        """
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        heard = time.monotonic()
        while True:
            left = max(0.0, min(_WAIT, deadline - time.monotonic()))
            try:
                info = self.session.get(RunInfo, self.path, wait=left)
            except (UnreachableError, ServiceError) as error:
                if not passes(error) or time.monotonic() - heard > _PATIENCE:
                    raise
                if time.monotonic() >= deadline:
                    raise TimeoutError(f"run {self.id}: {error}") from None
                time.sleep(min(1.0, left))
                continue
            heard = time.monotonic()
            if info.state.final:
                return info
            if heard >= deadline:
                raise TimeoutError(f"run {self.id} is still {info.state.value} after {duration(timeout)}")

    def cancel(self) -> RunInfo:
        """Asks it to stop; to ask twice does no harm."""
        return self.session.post(RunInfo, f"{self.path}:cancel")

    def purge(self) -> None:
        """Removes everything of it from the server, once it has ended. There is no way back."""
        self.session.delete(self.path)

    def checkpoint(self) -> RunInfo:
        """Asks it for a checkpoint; a ``Checkpoint`` message tells of it when it is on disk."""
        return self.session.post(RunInfo, f"{self.path}:checkpoint")

    def take_snapshot(self) -> RunInfo:
        """Asks it for a snapshot of the fragments; a ``Snapshot`` message tells of it when it is on disk."""
        return self.session.post(RunInfo, f"{self.path}:snapshot")

    # Messages ---------------------------------------------------------------------------------------------------------

    def events(self, after: int = 0) -> list[AnyMessage]:
        """The messages in its journal with a number above ``after``."""
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
        """Every message after ``after``, once and in order: what was said, then what is said, to the run's end.

        Over Zenoh where it can be reached, else over SSE; ``link`` chooses.
        """
        from .remote.stream import follow  # zenoh is loaded when it is needed

        return follow(link or self.link(), self.events, lambda: self.status().state.final, after)

    def link(self) -> Link:
        """A subscription to the run: over Zenoh where it can be reached, else over SSE."""
        from .remote.stream import SseLink, StreamError, ZenohLink  # zenoh is loaded when it is needed

        me = self.session.me()
        if me.zenoh is not None:
            with suppress(StreamError):
                return ZenohLink(me.zenoh, keys.run_prefix(me.owner, self.id))
        return SseLink(lambda: self.session.stream(f"{self.path}/stream"))

    def watch(self, live: bool | None = None) -> Live:
        """Shows the run in the terminal until it ends. ``live`` chooses the panel or plain lines; None: as it fits."""
        from .watch import watch  # rich is loaded when it is needed

        return watch(self, live)

    def history(self, points: int = 1000) -> dict[str, Any]:
        """Its course so far in at most so many reports: ``series``, ``ranks``, ``balance``, ``snapshots``, ``last``."""
        return self.session.get(dict[str, Any], f"{self.path}/history", points=points)

    # Snapshots --------------------------------------------------------------------------------------------------------

    def snapshots(self) -> list[Told]:
        """What its journal tells of the snapshots of its fragments that there are."""
        return self.session.get(SnapshotPage, f"{self.path}/snapshots").snapshots

    def snapshot(self, n: int = -1) -> Snapshot:
        """Snapshot ``n``; the newest for -1. Raises UnfinishedError when there is none."""
        number = n if n >= 0 else max((told.n for told in self.snapshots()), default=0)
        try:
            return Snapshot(self.session.fetch(f"{self.path}/snapshots/{number}"))
        except NotFoundError:
            raise self._lacks(f"snapshot {number}") from None

    def fragments(self, after: int = 0, link: Link | None = None) -> Generator[Snapshot]:
        """Every snapshot whose message comes after message ``after``, as they are made, to the run's end.

        Over Zenoh they come with their messages; one that does not is fetched from the server.
        """
        chosen = link or self.link()
        for message in self.messages(after, chosen):
            if isinstance(message, Told):
                data = getattr(chosen, "blobs", {}).get(message.sha256)
                yield Snapshot(data) if data else self.snapshot(message.n)

    # Files ------------------------------------------------------------------------------------------------------------

    def files(self) -> list[FileInfo]:
        """What lies in its folder."""
        return self.session.get(Listing, f"{self.path}/files").files

    def download(self, folder: Path | str, name: str | None = None) -> Path:
        """Copies one file, or all, into ``folder`` and returns the path of the file, or the folder.

        Raises AnswerError where a file of a run that has ended is not as large as the server lists it.
        """
        root = Path(folder)
        if name is not None:
            return self.fetch(root, FileInfo(path=name))
        final = self.over()
        for file in self.files():
            self.fetch(root, file, final)
        return root

    def over(self) -> bool:
        """Whether it has ended: its files change no more."""
        return self.status().state.final

    def fetch(self, folder: Path, file: FileInfo, final: bool = False) -> Path:
        """Copies a file of the list into ``folder`` and returns its path; of a run that has ended, ``final``, it must
        be as large as the list has it.
        """
        target = inside(folder, file.path)
        try:
            self.session.download(self._address(file), target, file.size if final else None)
        except NotFoundError:
            raise self._lacks(file.path) from None
        return target

    def _address(self, file: FileInfo) -> str:
        """The one that the server tells, if it is of this run; else that of its path."""
        own = f"{self.path}/files/"
        return file.url if file.url.startswith(own) else f"{own}{quoted(file.path, safe='/')}"

    def _lacks(self, what: str) -> ClientError:
        """What is raised for something that the run has not written, or for a run that there is none of."""
        try:
            self.status()
        except NotFoundError as error:
            return error
        return UnfinishedError(f"run {self.id} has no {what}")

    def result(self) -> Result:
        """What it has written: fetched when it is asked for, kept until the result is gone."""
        return Result(RemoteFolder(self))


class RemoteFolder:
    """A run's folder behind a server; each file is fetched once, into a folder that goes away with this one."""

    def __init__(self, run: Run) -> None:
        """Fetches nothing yet."""
        self.run = run
        self.root = Path(tempfile.mkdtemp(prefix="conoid-"))
        weakref.finalize(self, shutil.rmtree, self.root, ignore_errors=True)

    @property
    def name(self) -> str:
        """The run's id."""
        return self.run.id

    def names(self) -> list[str]:
        """Every file, relative to the folder."""
        return [file.path for file in self.run.files()]

    def path(self, name: str) -> Path:
        """A local copy."""
        target = inside(self.root, name)
        return target if target.is_file() else self.run.download(self.root, name)

    def told(self, name: str) -> str:
        """Its run and server: the local copy goes away."""
        return f"{name} of run {self.run.id} at {self.run.session.url}"
