"""Faults of a whole server: disks, clocks, descriptors, the database, and the processes of the server."""

import errno
import os
import resource
import shutil
import signal
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

from conoid.server.launch import processes

from . import server
from .situations import STORAGE
from .stand import Stand
from .strike import Deed, Strike

DATABASE = "server.sqlite"


def nothing(stand: Stand) -> None:
    """Does nothing: the fault ends without an action."""


# Disks ----------------------------------------------------------------------------------------------------------------


def fails(number: int, what: str = "write", every: int = 1) -> Deed:
    """Returns a function that makes file operations of the server fail; the file operations of its workers do not
    fail.
    """
    return lambda stand: void(stand.order.write_text(server.order(number, what, every)))


def void(_: object) -> None:
    """Has no effect; the return value None makes a lambda with an expression a deed."""


def mend(stand: Stand) -> None:
    """Ends the fault of the server's disk."""
    stand.order.unlink(missing_ok=True)


def and_killed(deed: Deed) -> Deed:
    """Returns a function that starts a fault, kills the server and tries to start it; the start may fail during the
    fault."""

    def both(stand: Stand) -> None:
        deed(stand)
        stand.kill()
        stand.start(10.0)

    return both


def and_started(lift: Deed) -> Deed:
    """Returns a function that ends a fault and, as an operator would, starts the server if no server is running."""

    def both(stand: Stand) -> None:
        lift(stand)
        if stand.child is None or stand.child.poll() is not None:
            assert stand.start(), stand.last_line()

    return both


def filled(stand: Stand) -> None:
    """Fills the disk completely."""
    with (stand.runs / "filler").open("wb", buffering=0) as file:
        size = 0
        for chunk in (1 << 24, 1 << 12):
            with suppress(OSError):
                while True:
                    os.posix_fallocate(file.fileno(), size, chunk)
                    size += chunk


def emptied(stand: Stand) -> None:
    for path in stand.runs.glob("filler*"):
        path.unlink()


def crowded(stand: Stand) -> None:
    """Creates files until the file system has no free inode."""
    place = stand.runs / "filler-many"
    place.mkdir()
    with suppress(OSError):
        for n in range(1 << 20):
            (place / str(n)).touch()


def thinned(stand: Stand) -> None:
    shutil.rmtree(stand.runs / "filler-many")


def mode(number: int) -> Deed:
    """Returns a function that sets the permissions of the folder of runs."""
    return lambda stand: stand.runs.chmod(number)


def disks() -> Iterator[Strike]:
    """Yields the faults of the disk: first errors of the server's file operations, then real disks; each fault also
    with the server killed."""
    codes = ("ENOSPC", "EIO", "EROFS", "EDQUOT", "ESTALE", "EACCES", "ENOMEM")
    for code in codes:
        yield Strike(f"{code} at every write of the server", "storage", fails(getattr(errno, code)), mend)
    yield Strike("EIO at every flush", "storage", fails(errno.EIO, "fsync"), mend)
    yield Strike("ENOSPC at every renaming", "storage", fails(errno.ENOSPC, "rename"), mend)
    yield Strike("EIO at every third write", "storage", fails(errno.EIO, every=3), mend)
    for code in ("ENOSPC", "EIO"):
        deed = and_killed(fails(getattr(errno, code)))
        yield Strike(f"{code} and the server killed", "storage", deed, and_started(mend))
    for what, where in (("open", "opening"), ("write", "write"), ("fsync", "flush")):
        yield Strike(f"the server's disk hangs at every {where}", "hang", fails(0, what), mend, waits=2.0)
    hangs = and_killed(fails(0, "write"))
    yield Strike("the server's disk hangs and the server killed", "hang", hangs, and_started(mend), waits=2.0)
    real: tuple[tuple[str, Deed, Deed, str], ...] = (
        ("a full disk", filled, emptied, "disk"),
        ("a disk without inodes", crowded, thinned, "disk"),
        ("no permission for the runs", mode(0o000), mode(0o700), "unprivileged"),
        ("no permission to write runs", mode(0o500), mode(0o700), "unprivileged"),
    )
    for name, deed, lift, stand in real:
        yield Strike(name, "storage", deed, lift, stand, STORAGE)
        killed = f"{name} and the server killed"
        yield Strike(killed, "storage", and_killed(deed), and_started(lift), stand, STORAGE | {"lost/service"})


# Descriptors ----------------------------------------------------------------------------------------------------------


def few(left: int) -> Deed:
    """Returns a function that limits the descriptors of the server to ``left`` more than it has open."""

    def deed(stand: Stand) -> None:
        assert stand.child is not None
        used = max(map(int, os.listdir(f"/proc/{stand.child.pid}/fd"))) + 1
        _, hard = resource.prlimit(stand.child.pid, resource.RLIMIT_NOFILE)
        resource.prlimit(stand.child.pid, resource.RLIMIT_NOFILE, (used + left, hard))

    return deed


def many(stand: Stand) -> None:
    assert stand.child is not None
    _, hard = resource.prlimit(stand.child.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(stand.child.pid, resource.RLIMIT_NOFILE, (hard, hard))


def descriptors() -> Iterator[Strike]:
    """Yields the faults of descriptors: no free descriptor, one free descriptor, and errors when files are opened."""
    yield Strike("no descriptor left", "descriptors", few(0), many)
    yield Strike("one descriptor left", "descriptors", few(1), many)
    yield Strike("EMFILE at every opening", "descriptors", fails(errno.EMFILE, "open"), mend)
    yield Strike("ENFILE at every second opening", "descriptors", fails(errno.ENFILE, "open", 2), mend)


# Clocks ---------------------------------------------------------------------------------------------------------------


def clock(words: str) -> Deed:
    """Returns a function that changes the real-time clock of the server; ``words`` have the syntax of libfaketime.
    Workers keep the true clock, because ``sleep`` fails under libfaketime."""
    return lambda stand: void((stand.root / "clock").write_text(words))


def clocks() -> Iterator[Strike]:
    """Yields the faults of the real-time clock: set forward, set back, too fast, too slow. The monotonic clock is not
    changed. libfaketime keeps a rate until another rate is set."""
    right = clock("+0 x1")
    for name, words in (
        ("set forward by a day", "+1d"), ("set back by a day", "-1d"), ("set forward by 10 s", "+10"),
        ("set back by 10 s", "-10"), ("set back by ten years", "-10y"), ("a hundred times too fast", "+0 x100"),
        ("ten times too slow", "+0 x0.1"),
    ):  # fmt: skip
        yield Strike(f"the clock {name}", "clock", clock(words), right, "clock")
    for name, words in (("set forward by a day", "+1d"), ("set back by a day", "-1d")):
        yield Strike(
            f"the clock {name} and the server killed", "clock", and_killed(clock(words)), and_started(right), "clock"
        )


# Database -------------------------------------------------------------------------------------------------------------


def locked(stand: Stand) -> None:
    """Locks the database by another connection that stays open."""
    other = sqlite3.connect(stand.runs / DATABASE, isolation_level=None, check_same_thread=False)
    other.execute("begin immediate")
    _locks[stand.root] = other


def unlocked(stand: Stand) -> None:
    other = _locks.pop(stand.root)
    other.execute("rollback")
    other.close()


_locks: dict[Path, sqlite3.Connection] = {}


def files(stand: Stand, suffix: str = "*") -> list[Path]:
    """Returns the files of the database."""
    return list(stand.runs.glob(f"{DATABASE}{suffix}"))


def stopped(stand: Stand) -> None:
    """Stops the server normally, so that its database is a single file."""
    stand.signal(signal.SIGTERM)
    assert stand.child is not None
    stand.child.wait(30)


def down(deed: Callable[[Stand], None]) -> Deed:
    """Returns a function that acts while the server is stopped."""

    def both(stand: Stand) -> None:
        stopped(stand)
        deed(stand)
        stand.start(15.0)

    return both


def deleted(stand: Stand) -> None:
    for path in files(stand):
        path.unlink()


def saved(stand: Stand) -> None:
    """Copies the database, as a backup for the operator."""
    for path in files(stand):
        shutil.copy2(path, stand.root / path.name)


def garbled(stand: Stand) -> None:
    saved(stand)
    for path in files(stand, ""):
        path.write_bytes(os.urandom(path.stat().st_size))


def half(stand: Stand) -> None:
    saved(stand)
    for path in files(stand, ""):
        os.truncate(path, path.stat().st_size // 2)


def emptied_database(stand: Stand) -> None:
    for path in files(stand, ""):
        os.truncate(path, 0)


def folder_in_place(stand: Stand) -> None:
    saved(stand)
    for path in files(stand):
        path.unlink()
    (stand.runs / DATABASE).mkdir()


def without_log(stand: Stand) -> None:
    for path in files(stand, "-*"):
        path.unlink()


def read_only(stand: Stand) -> None:
    for path in files(stand):
        path.chmod(0o400)


def writable(stand: Stand) -> None:
    for path in files(stand):
        path.chmod(0o600)


def restored(stand: Stand) -> None:
    """Restores the database from the backup, or as an empty database, as an operator does if the server does not start
    or cannot use the database."""
    stand.kill()
    path = stand.runs / DATABASE
    if path.is_dir():
        path.rmdir()
    deleted(stand)
    for kept in stand.root.glob(f"{DATABASE}*"):
        shutil.move(kept, stand.runs / kept.name)
    assert stand.start(), stand.last_line()
    renewed(stand)


def renewed(stand: Stand) -> None:
    """Starts the server if necessary, and creates a new token if the old token was lost."""
    if stand.child is None or stand.child.poll() is not None:
        assert stand.start(), stand.last_line()
    if stand.ask("GET", "/v1/me")[0] == 401:
        stand.new_token()


def restarted(stand: Stand) -> None:
    """Restarts the server after its database was deleted."""
    stand.again()
    renewed(stand)


def databases() -> Iterator[Strike]:
    """Yields the faults of the database: locked, deleted, damaged, read-only."""
    yield Strike("the database locked for 8 s", "database", locked, unlocked, hold=8.0)
    yield Strike("the database deleted beneath the server", "database", deleted, restarted)
    yield Strike("the database deleted while no server was there", "database", down(deleted), renewed)
    yield Strike("the database overwritten beneath the server", "database", garbled, restored)
    yield Strike("the database overwritten while no server was there", "database", down(garbled), restored)
    yield Strike("half of the database lost while no server was there", "database", down(half), restored)
    yield Strike("the database emptied beneath the server", "database", emptied_database, restarted)
    yield Strike("the database emptied while no server was there", "database", down(emptied_database), renewed)
    yield Strike("a folder in the place of the database", "database", down(folder_in_place), restored)
    yield Strike("the database's log deleted beneath the server", "database", without_log, restarted)
    yield Strike("a read-only database", "database", read_only, writable, "unprivileged")


# The server's processes -----------------------------------------------------------------------------------------------


def killed(stand: Stand) -> None:
    stand.kill()


def started(stand: Stand) -> None:
    if stand.child is None or stand.child.poll() is not None:
        assert stand.start(), stand.last_line()


def killed_often(stand: Stand) -> None:
    """Kills the server three times, before the server has found its runs again."""
    for pause in (0.0, 0.05, 0.3):
        stand.kill()
        stand.start()
        time.sleep(pause)


def paused(stand: Stand) -> None:
    stand.signal(signal.SIGSTOP)


def goes_on(stand: Stand) -> None:
    stand.signal(signal.SIGCONT)


def reader_gets(stand: Stand, number: signal.Signals) -> None:
    """Sends a signal to the process that reads cases for the server."""
    assert stand.child is not None
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            mine = entry.name.isdigit() and b"conoid.server.intake.reading" in (entry / "cmdline").read_bytes()
            if mine and processes.parent(int(entry.name)) == stand.child.pid:
                os.kill(int(entry.name), number)


def kills() -> Iterator[Strike]:
    """Yields the faults of processes: the server, and its reader of cases."""
    yield Strike("the server killed", "kill", killed, started)
    yield Strike("the server killed three times", "kill", killed_often, started)
    yield Strike("the server stopped by a signal", "kill", stopped, started)
    yield Strike("the server paused for 3 s", "kill", paused, goes_on, hold=0.0, waits=1.0)
    yield Strike("the reader of cases killed", "kill", partial(reader_gets, number=signal.SIGKILL), nothing)
    stop, go = partial(reader_gets, number=signal.SIGSTOP), partial(reader_gets, number=signal.SIGCONT)
    yield Strike("the reader of cases paused", "kill", stop, go, waits=3.0)
    yield Strike("the reader of cases hangs for good", "hang", stop, nothing)


def everything() -> list[Strike]:
    """Returns all faults of a whole server, in the order in which the drill tries the faults."""
    return [*disks(), *descriptors(), *clocks(), *databases(), *kills()]
