"""A run as a job of a batch system (Slurm): the profiles of the site, the record of the job in the folder of the run,
the batch script, the arguments of sbatch.

Example of the settings file of a site (its other tables are described in the module ``policy``)::

    launcher = "slurm"                # what starts runs of the server: "local" (default) or "slurm"
    [slurm]
    default = "standard"              # the profile of runs that name none
    router = "tcp/login1:7447"        # the server's Zenoh router as compute nodes reach it
    [slurm.profiles.standard]
    partition = "compute"
    time = "12 h"
    modules = ["gcc/13"]

Users select a profile and cannot change it: the command of a job is in the file ``job.json``, and the batch script only
reads it from there.
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
    """Error: the settings file of a site is invalid. The text of this error is one line."""


class Profile(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """A profile: settings with which the batch system gives cores to a job."""

    partition: str = ""
    account: str = ""
    qos: str = ""
    time: str = ""
    """Time limit of a job, such as ``12 h``; empty: the time limit of the partition."""
    modules: list[str] = []
    """Names of modules that ``module load`` loads."""
    mpi: Literal["mpiexec", "srun"] = "mpiexec"
    """Command that starts the ranks inside of a job."""
    mpiexec: str = ""
    """Path of the mpiexec of the site; empty: the mpiexec that Conoid finds."""
    lines: list[str] = []
    """Lines of the batch script before the run starts, for the MPI or the file system of the site."""
    options: list[str] = []
    """Further arguments of the command sbatch."""
    notice: str = "120 s"
    """Time before the time limit at which a run receives the signal to write a checkpoint; it is enough for some
    checkpoints of the largest runs (chosen value)."""


class Slurm(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The settings of a site for Slurm."""

    profiles: dict[str, Profile]
    default: str = ""
    """Profile of runs that name no profile; empty: the first profile."""
    bin: str = ""
    """Folder of the commands sbatch, squeue, scancel and scontrol; empty: they are found in PATH."""
    router: str = ""
    """Address of the server's Zenoh router for compute nodes; empty: only the address of this machine."""
    listen: str = ""
    """Additional address on which the Zenoh router listens for compute nodes, such as ``tls/0.0.0.0:7448``."""
    certificate: str = ""
    key: str = ""
    """Private key of the Zenoh router; with TLS, certificate and key are required."""
    authority: str = ""
    """Certificate with which compute nodes verify the Zenoh router; the nodes must be able to read this file."""
    poll: float = 2.0
    """Time between two calls of squeue, which ask for the jobs of all runs, s (chosen value)."""
    slots: int = 100_000
    """Largest number of cores of all submitted jobs together, including pending jobs (chosen value). The number is
    large because Slurm has its own limits."""


class Site(msgspec.Struct, kw_only=True, frozen=True, forbid_unknown_fields=True):
    """The settings of a site that say how runs are started. The module ``policy`` has the other settings."""

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
"""Number of a job or a task, as text. The pattern ensures that the text cannot be read as an option when it is an
argument of a command."""


class Job(msgspec.Struct, kw_only=True, frozen=True):
    """The file job.json: the record of a job of the batch system. It is on disk before the job is submitted.

    Programs that read the folder of a run use only ``name`` and ``job``; ``command`` and ``bin`` are for the job.
    """

    run: str
    name: _Name
    """Unique name of the job: a program finds the job by this name if its number was not stored."""
    attempt: int
    ranks: int
    profile: str
    command: list[str]
    """Command that starts the ranks, without the option ``--restart``."""
    submitted: float
    """Unix time of the submission, s."""
    notice: float
    """Time before the time limit at which the run receives the signal to write a checkpoint, s."""
    bin: str = ""
    """Folder of Slurm's commands; empty: the commands are in PATH."""
    task: int | None = None
    """Index of the run in a job array, which is one job for several runs; None: the run has a job of its own."""
    array: str = ""
    """Folder of the job array."""
    job: _Number = ""
    """Number of the job in the batch system; empty until it is known."""
    accounting: dict[str, str] = {}
    """Properties of a job that has ended, as the batch system reported them."""
    threads: int = 1
    """Number of threads, and of cores, of each rank."""

    @property
    def key(self) -> str:
        """Unique name of the job; for a task of a job array with the index of the task."""
        return key_of(self.name, self.task)


class Access(msgspec.Struct, kw_only=True, frozen=True):
    """Hidden file, readable for its owner only: address and token with which the ranks of a job publish messages."""

    endpoint: str
    prefix: str
    user: str = ""
    password: str = ""
    authority: str = ""
    """Certificate with which the Zenoh router is verified; only with TLS."""


_job, _access = msgspec.json.Decoder(Job), msgspec.json.Decoder(Access)
_TEMPLATE = """#!/bin/bash
# One attempt of a run, written by Conoid: $1 is its folder or that of its array, $2 the job's name. See job.json there.
{lines}exec {python} -P -m conoid.worker.run.job "$1" "$2"
"""


def read_site(path: Path) -> Site:
    """Reads the settings file of a site. Raises SiteError if the file is invalid."""
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
    """Returns the profile ``name``, or the default profile. Raises ValueError with the existing names if there is no
    such profile.
    """
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
    """Returns the record of a new attempt to run a case, before it is submitted."""
    word = re.sub(r"[^A-Za-z0-9_.-]", "_", run)[:60]
    return Job(
        run=run, name=f"conoid-{word}-{attempt}-{secrets.token_hex(4)}", attempt=attempt, ranks=ranks, threads=threads,
        profile=profile[0], command=command, submitted=now, notice=_seconds(profile[1].notice),
        bin=place,
    )  # fmt: skip


def key_of(name: str, task: int | None) -> str:
    """Returns the name of a job, or of one task of a job array."""
    return name if task is None else f"{name}/{task}"


def script(profile: Profile, python: str) -> str:
    """Returns the batch script: the lines of the profile, then the command that starts the run. The script is the same
    for all runs and users.
    """
    modules = [f"module load {shlex.quote(module)}" for module in profile.modules]
    lines = "".join(f"{line}\n" for line in [*modules, *profile.lines])
    return _TEMPLATE.format(lines=lines, python=shlex.quote(python))


def sbatch_words(job: Job, profile: Profile, folder: Path) -> list[str]:
    """Returns the arguments of sbatch for a job. Only the script receives the signal TERM, ``notice`` before the time
    limit; the program that the script starts then sends signals to the ranks.
    """
    return _words(job, profile, folder, f"{layout.LOGS}/{layout.LAUNCHER_LOG}")


def array_words(job: Job, profile: Profile, tasks: Iterable[int]) -> list[str]:
    """Returns the arguments of sbatch for some tasks of the job array to which ``job`` belongs."""
    folder = Path(job.array)
    return [f"--array={','.join(map(str, tasks))}", *_words(job, profile, folder, "%a.log")]


def _words(job: Job, profile: Profile, folder: Path, log: str) -> list[str]:
    """Returns the arguments of sbatch that are the same for jobs and job arrays. ``log``: path of the log file,
    relative to ``folder``. Slurm interprets percent signs in this path, also in the name of the folder, and removes
    backslashes. If the folder has such characters, the job opens its log itself.
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
    """Returns the command that starts ``ranks`` ranks with ``threads`` threads each inside a job; the command of the
    worker follows it.

    ``found``: function that returns the path of an mpiexec, for a profile that has none. MPICH from its Python package
    needs PMI2. srun does not take the numbers of ranks and threads from the job (srun(1)); it binds each rank to its
    own cores.
    """
    if profile.mpi == "srun":
        return ["srun", "--mpi=pmi2", f"--ntasks={ranks}", f"--cpus-per-task={threads}", "--cpu-bind=cores"]
    return [*(shlex.split(profile.mpiexec) or found()), "-n", str(ranks)]


def read_job(folder: Path) -> Job | None:
    """Returns the job record of a run; None if there is none. Raises OSError, msgspec.MsgspecError."""
    try:
        return _job.decode(whole.read(folder / layout.JOB))
    except FileNotFoundError:
        return None


def read_access(folder: Path) -> Access | None:
    """Returns the file ``Access`` of a run; None if there is none. Raises OSError, msgspec.MsgspecError."""
    try:
        return _access.decode(whole.read(folder / layout.ACCESS))
    except FileNotFoundError:
        return None


def to_json(record: Job | Access) -> bytes:
    """Returns a record as the text of its file."""
    return msgspec.json.format(msgspec.json.encode(record), indent=2)
