"""A run as a job of a batch system: the site's profiles, the record in the run's folder, the script, sbatch's words.

A site's settings file (its other tables are those of ``policy``)::

    launcher = "slurm"                # who starts runs of the server: "local" (default) or "slurm"
    [slurm]
    default = "standard"              # the profile of those who name none
    router = "tcp/login1:7447"        # the server's Zenoh router as compute nodes reach it
    [slurm.profiles.standard]
    partition = "compute"
    time = "12 h"
    modules = ["gcc/13"]

Users name a profile and add nothing to it: what a job runs is in ``job.json``, and the script only reads it.
"""

import re
import secrets
import shlex
import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from ..output import layout
from ..reading import whole
from ..reading.similar import allowed
from ..units import parse_quantity
from . import policy


class SiteError(Exception):
    """The settings file cannot be used; the text is one line."""


class Profile(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """One way of asking the batch system for cores."""

    partition: str = ""
    account: str = ""
    qos: str = ""
    time: str = ""
    """The time limit of a job, such as ``12 h``; empty: the partition's."""
    modules: list[str] = []
    """That ``module load`` gets."""
    mpi: Literal["mpiexec", "srun"] = "mpiexec"
    """What starts the ranks inside the job."""
    mpiexec: str = ""
    """A site's own; empty: the one that Conoid finds."""
    lines: list[str] = []
    """Of the script, before the run: what the site's MPI or file system needs."""
    options: list[str] = []
    """Further words for sbatch."""
    notice: str = "120 s"
    """How long before the time limit a run is told to keep its state. Chosen: some checkpoints of the largest runs."""


class Slurm(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A site's Slurm."""

    profiles: dict[str, Profile]
    default: str = ""
    """The profile of those who name none; empty: the first."""
    bin: str = ""
    """Folder of sbatch, squeue, scancel, scontrol; empty: they are in PATH."""
    router: str = ""
    """The server's Zenoh router as compute nodes reach it; empty: the address of this machine alone."""
    listen: str = ""
    """Where the router listens for compute nodes besides, such as ``tls/0.0.0.0:7448``."""
    certificate: str = ""
    key: str = ""
    """Of the router; needed where it listens with TLS."""
    authority: str = ""
    """The certificate by which the nodes know the router: a file that they see."""
    poll: float = 2.0
    """s between two looks at the queue: one squeue for all runs. Chosen."""
    slots: int = 100_000
    """Cores that the server hands over at a time, pending ones included. Chosen: Slurm has the limits."""


class Site(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """What a site decides: how runs are started, and by ``policy`` when, how large, how long they are kept, and what
    one user may hold of the server.
    """

    launcher: Literal["local", "slurm"] = "local"
    slurm: Slurm | None = None
    queue: policy.Queue = policy.Queue()
    quota: policy.Quota = policy.Quota()
    caps: policy.RunCaps = policy.RunCaps()
    retention: policy.Retention = policy.Retention()
    http: policy.Http = policy.Http()
    files: policy.Files = policy.Files()


_Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\Z")]
_Number = Annotated[str, msgspec.Meta(pattern=r"^([0-9]+(_[0-9]+)?)?\Z")]
"""What stands in a record is given to commands: it can be none of their options."""


class Job(msgspec.Struct, kw_only=True, frozen=True):
    """job.json: what a job of the batch system runs. It is on disk before the batch system hears of it.

    Who looks at a folder believes nothing in it but the name and the number: ``command`` and ``bin`` are for the job.
    """

    run: str
    name: _Name
    """Of the job; no other job has it, so that a job is found whose number nobody could note."""
    attempt: int
    ranks: int
    profile: str
    command: list[str]
    """Starts the ranks, without ``--restart``."""
    submitted: float
    """Unix s."""
    notice: float
    """s before the time limit at which the run is told."""
    bin: str = ""
    """Folder of Slurm's commands; empty: they are in PATH."""
    task: int | None = None
    """Its place in an array, one job for several runs; None: a job of its own."""
    array: str = ""
    """The folder of the array."""
    job: _Number = ""
    """The number that the batch system gave; empty until it is known."""
    accounting: dict[str, str] = {}
    """What the batch system tells of a job that has ended."""
    threads: int = 1
    """Of each rank: cores that it gets."""

    @property
    def key(self) -> str:
        """No other run has it."""
        return key_of(self.name, self.task)


class Access(msgspec.Struct, kw_only=True, frozen=True):
    """Where the ranks of a job publish, and as whom; in a hidden file that only its owner may read."""

    endpoint: str
    prefix: str
    user: str = ""
    password: str = ""
    authority: str = ""
    """Of the router's certificate, where it speaks TLS."""


_job, _access = msgspec.json.Decoder(Job), msgspec.json.Decoder(Access)
_TEMPLATE = """#!/bin/bash
# One attempt of a run, written by Conoid: $1 is its folder or that of its array, $2 the job's name. See job.json there.
{lines}exec {python} -m conoid.worker.run.job "$1" "$2"
"""


def read_site(path: Path) -> Site:
    """The settings file of a site. Raises SiteError."""
    try:
        site = msgspec.convert(tomllib.loads(whole.read_text(path)), Site)
        if site.slurm is not None:
            _check(site.slurm)
        policy.check(site.queue, site.quota, site.caps, site.retention, site.http, site.files)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SiteError(f"{path}: {reason}") from None
    if site.launcher == "slurm" and site.slurm is None:
        raise SiteError(f'{path}: launcher = "slurm" needs a table [slurm]')
    return site


def _check(slurm: Slurm) -> None:
    if not slurm.profiles:
        raise ValueError("slurm.profiles: at least one is needed")
    profile_of(slurm, "")
    if slurm.listen.startswith("tls/") and not (slurm.certificate and slurm.key and slurm.authority):
        raise ValueError("slurm.listen: tls/ needs slurm.certificate, slurm.key and slurm.authority")
    for name, profile in slurm.profiles.items():
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,32}", name):
            raise ValueError(f"slurm.profiles.{name}: allowed: 1 to 32 letters, digits, '_' and '-'")
        for text in (profile.time, profile.notice):
            _seconds(text)


def profile_of(slurm: Slurm, name: str) -> tuple[str, Profile]:
    """The profile of that name, or the default one. Raises ValueError with those that there are."""
    chosen = name or slurm.default or next(iter(slurm.profiles))
    if chosen not in slurm.profiles:
        raise ValueError(f"profile = {chosen[:40]!r}: {allowed(chosen, slurm.profiles)}")
    return chosen, slurm.profiles[chosen]


def _seconds(text: str) -> float:
    return parse_quantity(text, "s") if text else 0.0


def new_job(
    run: str,
    ranks: int,
    profile: tuple[str, Profile],
    command: list[str],
    now: float,
    attempt: int = 1,
    place: str = "",
    threads: int = 1,
) -> Job:
    """The record of an attempt that nobody has handed over yet."""
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", run)[:60]
    return Job(
        run=run, name=f"conoid-{word}-{attempt}-{secrets.token_hex(4)}", attempt=attempt, ranks=ranks, threads=threads,
        profile=profile[0], command=command, submitted=now, notice=_seconds(profile[1].notice),
        bin=place,
    )  # fmt: skip


def key_of(name: str, task: int | None) -> str:
    """Of a job of that name, or of one task of an array of that name."""
    return name if task is None else f"{name}/{task}"


def script(profile: Profile, python: str) -> str:
    """The batch script: the site's lines, then the run. Nothing in it depends on the run or on its owner."""
    modules = [f"module load {shlex.quote(module)}" for module in profile.modules]
    lines = "".join(f"{line}\n" for line in [*modules, *profile.lines])
    return _TEMPLATE.format(lines=lines, python=shlex.quote(python))


def sbatch_words(job: Job, profile: Profile, folder: Path) -> list[str]:
    """The arguments of sbatch. TERM reaches the script alone ``notice`` before the limit; the script's program tells
    the ranks.
    """
    return _words(job, profile, folder, f"{layout.LOGS}/{layout.LAUNCHER_LOG}")


def array_words(job: Job, profile: Profile, tasks: Iterable[int]) -> list[str]:
    """The arguments of sbatch for some tasks of an array, of which ``job`` is one."""
    folder = Path(job.array)
    return [f"--array={','.join(map(str, tasks))}", *_words(job, profile, folder, "%a.log")]


def _words(job: Job, profile: Profile, folder: Path, log: str) -> list[str]:
    """``log`` below ``folder``. Slurm replaces what follows a percent sign, and takes a backslash away, in the name of
    the folder, too: where that has one, the job opens its log itself.
    """
    if set(str(folder)) & {"%", "\\"}:
        log = "/dev/null"
    words = [
        "--parsable", f"--job-name={job.name}", f"--ntasks={job.ranks}", f"--cpus-per-task={job.threads}",
        f"--chdir={folder}", f"--output={log}",
        "--open-mode=append", "--requeue", "--export=ALL", f"--signal=B:TERM@{job.notice:.0f}",
    ]  # fmt: skip
    named = (("partition", profile.partition), ("account", profile.account), ("qos", profile.qos))
    words += [f"--{option}={value}" for option, value in named if value]
    if profile.time:
        words.append(f"--time={max(1, round(_seconds(profile.time) / 60.0))}")
    return [*words, *profile.options, str(folder / layout.JOB_SCRIPT), str(folder), job.name]


def starter(profile: Profile, ranks: int, found: Callable[[], Sequence[str]], threads: int = 1) -> list[str]:
    """What starts ``ranks`` ranks of so many ``threads`` inside a job, before the worker's command; ``found`` gives an
    mpiexec where the profile has none of its own. PMI2 is what the wheel of MPICH speaks. srun takes neither number
    from the job (srun(1)), and gives each rank cores of its own.
    """
    if profile.mpi == "srun":
        return ["srun", "--mpi=pmi2", f"--ntasks={ranks}", f"--cpus-per-task={threads}", "--cpu-bind=cores"]
    return [*(shlex.split(profile.mpiexec) or found()), "-n", str(ranks)]


def read_job(folder: Path) -> Job | None:
    """The record in a run's folder; None when there is none. Raises OSError, msgspec.MsgspecError."""
    try:
        return _job.decode(whole.read(folder / layout.JOB))
    except FileNotFoundError:
        return None


def read_access(folder: Path) -> Access | None:
    """Where the ranks publish; None: nowhere. Raises OSError, msgspec.MsgspecError."""
    try:
        return _access.decode(whole.read(folder / layout.ACCESS))
    except FileNotFoundError:
        return None


def to_json(record: Job | Access) -> bytes:
    """As it stands in the folder."""
    return msgspec.json.format(msgspec.json.encode(record), indent=2)
