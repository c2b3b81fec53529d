"""Settings of a server: folder of runs, cores, start of workers, limits of a run."""

import ipaddress
import os
import shlex
import sys
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy import URL

from conoid.cases.estimates.cores import usable_cores
from conoid.cases.site.batch import Site, SiteError, read_site

WORKER = (sys.executable, "-P", "-m", "mpi4py", "-m", "conoid.worker")
"""Command of the worker after ``mpiexec -n N``. Because of ``-m mpi4py``, an exception of one rank ends all ranks."""


class StartError(Exception):
    """Error: the server or one of its commands cannot work. The text of the error is one line for the user."""

    exit_code = 1
    """Exit code of the command: 2 for a wrong request, 1 for any other failure, as in the client."""


class SettingsError(StartError):
    """Error: a setting cannot be used. The message of this error names the setting, its value and the allowed
    values.
    """

    exit_code = 2


def memory_bytes() -> int:
    """Returns the physical memory of this machine, bytes."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


@dataclass(frozen=True)
class Caps:
    """Limits of a case that may be submitted. The server compares the estimate of the case with these limits; None: no
    limit.
    """

    elements: int | None = 100_000_000
    steps: int | None = 100_000_000
    memory: int | None = field(default_factory=memory_bytes)
    """Largest memory of all ranks together, bytes."""
    core_seconds: float | None = None
    wall_time: float | None = None
    """Largest wall time of a run, s. A case with a smaller ``run.max_wall_time`` is stopped at its own limit."""
    queued: int = 1000
    """Largest number of runs of an owner that have not ended."""
    output_bytes: int | None = None
    """Largest size of the folder of a run, bytes; a run that exceeds it is stopped."""
    free_disk: int = 1 << 30
    """Number of bytes that must be free on the disk of the runs before a run is accepted."""


@dataclass(frozen=True)
class Settings:
    """All options of ``python -m conoid.server``. Raises SettingsError if the options contradict each other."""

    runs: Path
    host: str = "127.0.0.1"
    port: int = 8750
    """Port of HTTP; 0: any free port."""
    zenoh_port: int | None = 7447
    """Port of Zenoh; 0: any free port; None: no Zenoh router, so that clients follow runs over SSE."""
    slots: int = field(default_factory=usable_cores)
    """Largest number of cores that all runs together use at a time; a run uses the number of its ranks times the number
    of its threads."""
    auth: bool = True
    web: Path | None = None
    """Folder of the live page, served at ``/``."""
    database: str = ""
    """SQLAlchemy URL; empty: SQLite in the runs' folder."""
    mpiexec: str = ""
    """Launcher of the site; empty: the launcher beside this Python, else the launcher in PATH."""
    worker: tuple[str, ...] = WORKER
    grace: float = 30.0
    """Time in s between the request to stop a worker and the forced kill of the worker."""
    end_runs: bool = False
    """Whether all runs are cancelled when the server stops. If runs are not cancelled, the workers continue, and the
    next server supervises them."""
    caps: Caps = field(default_factory=Caps)
    site: Site = field(default_factory=Site)
    """Settings of the site: launcher, and profiles of batch systems."""

    def __post_init__(self) -> None:
        if not self.auth and not loopback(self.host):
            raise SettingsError(f"--no-auth with --host {self.host}: allowed only on a loopback address")
        if self.slots < 1:
            raise SettingsError(f"--slots {self.slots}: at least one core is needed")
        if not self.grace > 0:
            raise SettingsError(f"--grace {self.grace}: a number of seconds above 0")
        for name, port in (("--port", self.port), ("--zenoh-port", self.zenoh_port or 0)):
            if not 0 <= port <= 65535:
                raise SettingsError(f"{name} {port}: 0 (any free port) to 65535")
        if self.mpiexec:
            command(self.mpiexec, "--mpiexec")
        if self.web is not None and not self.web.is_dir():
            raise SettingsError(f"--web {self.web}: there is no such folder")

    @property
    def database_url(self) -> str | URL:
        """Returns the URL of the database. The URL is built from parts, because ``%``, ``?`` or ``#`` in a file name
        have a special meaning in the text of a URL.
        """
        return self.database or URL.create("sqlite", database=str(self.database_file))

    @property
    def database_file(self) -> Path:
        """Returns the file of the default database."""
        return self.runs / "server.sqlite"


def loopback(host: str) -> bool:
    """Whether ``host`` can be reached only from this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def capped(site: Site) -> dict[str, float]:
    """Returns the limits of a run from a site's settings file."""
    named = {name: getattr(site.caps, name) for name in site.caps.__struct_fields__}
    return {name: cap for name, cap in {**named, "queued": site.quota.queued}.items() if cap is not None}


def site_of(path: Path | None) -> Site:
    """Returns the settings in the file of a site; without a file, the server starts the runs itself on this machine.
    Raises SettingsError if the file is invalid.
    """
    try:
        return Site() if path is None else read_site(path)
    except SiteError as error:
        raise SettingsError(f"--site {error}") from None


def command(text: str, option: str = "--worker") -> tuple[str, ...]:
    """Returns a command line as a list of arguments; no shell is used. Raises SettingsError if the command line is
    invalid.
    """
    try:
        words = tuple(shlex.split(text))
    except ValueError as error:
        raise SettingsError(f"{option} {text!r}: {error}") from None
    if not words:
        raise SettingsError(f"{option} '': a command is needed")
    return words
