"""Display of a run in the terminal until it ends: a live panel on a terminal, plain text lines otherwise."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.live import Live as Screen

from conoid.cases.figures import clock, duration
from conoid.cases.messages import AnyMessage, Log, Progress, Snapshot, Status
from conoid.cases.run import State

from .commands import progress
from .commands.console import PlainConsole, one_line
from .commands.display import line, panel, seen
from .errors import ClientError, UnreachableError
from .live import Live
from .remote.link import Link

REASON_EVERY = 3.0
"""Time between two requests for the reason why a queued run waits, s (chosen value: below the 8 s after which a
progress line is printed)."""


class Titled(Protocol):
    """Interface of a status of a run that has a title."""

    @property
    def title(self) -> str:
        """Title of the run for people."""


class Watched(Protocol):
    """Interface of a run that can be followed."""

    id: str

    def status(self) -> Titled:
        """Returns the present status."""

    def link(self) -> Link:
        """Opens a subscription to the messages of the run."""

    def messages(self, *, link: Link) -> Iterable[AnyMessage]:
        """Yields all messages of the run once and in order."""


def watch(run: Watched, live: bool | None = None, console: Console | None = None) -> Live:
    """Shows ``run`` until its end. ``live``: True for the panel, False for plain text lines, None to choose by the
    terminal.
    """
    out = console or PlainConsole()
    known = Live(run.id, title=run.status().title)
    link = run.link()
    known.link = link.name
    messages = run.messages(link=link)
    with explained(run, known):
        if out.is_terminal if live is None else live:
            return show(messages, known, out)
        return tell(messages, known, lambda text: out.print(one_line(text), soft_wrap=True))


@contextmanager
def explained(run: Watched, known: Live) -> Iterator[None]:
    """Context in which a thread asks the server, while ``run`` is queued or sends no messages, why the run waits and
    whether the server answers.
    """
    over = threading.Event()

    def ask() -> None:
        received = -1
        while not over.wait(REASON_EVERY):
            if known.state is State.QUEUED or known.seq == received:
                _ask(run, known)
            received = known.seq

    thread = threading.Thread(target=ask, name="reason", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()


def _ask(run: Watched, known: Live) -> None:
    try:
        known.reason, known.away = getattr(run.status(), "reason", ""), 0.0
    except UnreachableError:
        known.away = known.away or time.time()
    except (ClientError, RuntimeError):  # The session may be closed already.
        return


def show(messages: Iterable[AnyMessage], known: Live, out: Console) -> Live:
    """Shows the panel, which is drawn four times a second, until the messages end."""
    with Screen(get_renderable=lambda: panel(known), console=out, refresh_per_second=4) as screen:
        for message in messages:
            known.take(message)
        screen.refresh()
    return known


def tell(messages: Iterable[AnyMessage], known: Live, write: Callable[[str], None]) -> Live:
    """Prints one plain text line for each change of state, each warning and each percent of progress. While no
    message arrives, it prints progress lines, which become rarer.
    """
    printed, texts = -1, set[str]()
    with progress.broken(write, lambda: _waiting(known)) as say:
        for message in messages:
            known.take(message)
            at = int(100.0 * known.fraction + 1e-9)
            if isinstance(message, Snapshot):
                say(f"{clock(message.wall)}  {known.run}  {seen(message)}")
            elif isinstance(message, Log):
                if message.level in {"warning", "error"} and message.text not in texts:
                    texts.add(message.text)
                    say(f"{clock(message.wall)}  {known.run}  {message.level}: {message.text}")
            elif isinstance(message, Status) or (isinstance(message, Progress) and at > printed):
                printed = max(printed, at) if isinstance(message, Progress) else printed
                say(line(known))
    return known


def _waiting(known: Live) -> str:
    if known.away:
        away = f"no server answers, for {duration(time.time() - known.away)}"
        return f"{clock(time.time())}  {known.run}  {away}; it was {known.state.value} at its last message"
    lasting = f", for {duration(time.time() - known.changed)}" if known.changed else ""
    at = f": {known.explanation}" if known.explanation else ""
    return f"{clock(time.time())}  {known.run}  still {known.state.value}{lasting}{at}"
