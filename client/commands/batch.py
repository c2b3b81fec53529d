"""The command ``conoid batch``: it submits a run as a job of Slurm, without a server. The run folder has the same
content as that of a run on a server.
"""

import json
import os
import shutil
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer

from conoid.cases import messages
from conoid.cases.load import parse_case, resolved_json
from conoid.cases.model.schema import Run
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import State
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.batch import Job, Slurm

from ..errors import ClientError
from ..examination import examine
from ..local.folders import LocalFolder
from ..local.local_files import Hashes, keep_copies, with_hashes
from ..remote.submission import data_of, folder_of
from .console import echo, echo_json
from .options import CaseArgument, Json, Overrides, Ranks, Threads, aloud, on_cores, warn

_CASE = "case.json"
"""Name of the case file in the run folder; the job's command reads this file."""
_PLACES = ("~/.config/conoid/site.toml", "/etc/conoid/site.toml")


@dataclass(frozen=True)
class Handed:
    """A run that was submitted to Slurm."""

    folder: Path
    job: str
    profile: str
    attempt: int


def batch_run(
    case: CaseArgument,
    ranks: Ranks = None,
    threads: Threads = None,
    profile: Annotated[
        str,
        typer.Option(
            "--slurm", metavar="PROFILE", help="Profile of the batch system; default: the site's default profile."
        ),
    ] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the run; default: runs/<name>.")] = None,
    overrides: Overrides = None,
    site: Annotated[
        Path | None,
        typer.Option("--site", help="Settings file of the site; default: CONOID_SITE, else the usual place."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Submit a case to Slurm without a server, and print the number of the job.

    conoid watch FOLDER follows the run. If the command is repeated, no second job is made: the command prints the
    existing job, or continues a run that was lost.
    """
    words = [*(overrides or ()), *on_cores(ranks, threads)]
    with aloud("reading mesh files"):
        found = examine(data_of(case, words), folder_of(case))
    warn(found.odd)
    handed = hand_over(case, words, out, profile, slurm_of(site))
    if as_json:
        echo_json({"folder": str(handed.folder), "job": handed.job, "attempt": handed.attempt})
    else:
        echo(f"job {handed.job}  profile {handed.profile}  folder {handed.folder}")


def slurm_of(site: Path | None) -> Slurm:
    """Returns the Slurm settings of the site. Without a settings file there is one profile with Slurm's defaults.
    Raises ClientError.
    """
    named = site or (Path(os.environ["CONOID_SITE"]) if os.environ.get("CONOID_SITE") else None)
    found = named or next((path for place in _PLACES if (path := Path(place).expanduser()).is_file()), None)
    try:
        settings = batch.read_site(found).slurm if found is not None else None
    except batch.SiteError as error:
        raise ClientError(str(error)) from None
    return settings or Slurm(profiles={"default": batch.Profile()})


def job_of(folder: Path) -> Job | None:
    """Returns the record of the Slurm job in a run folder; None if the folder has no record. Raises ClientError if
    the record is unreadable.
    """
    try:
        return batch.read_job(folder)
    except msgspec.MsgspecError as error:
        raise ClientError(f"{folder / layout.JOB}: the record of the job cannot be read: {error}") from None


def hand_over(case: str, overrides: Iterable[str], out: Path | None, profile: str, site: Slurm) -> Handed:
    """Submits one job for the run in a folder; the folder may be new or have an earlier job. Raises CaseError,
    ClientError.
    """
    data = data_of(case, overrides)
    files = Hashes().of(data, folder_of(case))
    data = with_hashes(data, files)
    checked = parse_case(data)
    resolved = resolved_json(checked)
    folder = (out or Path("runs") / checked.name).resolve()
    try:
        chosen = batch.profile_of(site, profile or checked.run.profile)
        if shutil.which("sbatch", path=site.bin or None) is None:
            raise ClientError(
                "sbatch: not found; Slurm's commands must be in PATH, or [slurm] bin must name their folder"
            )
        job = _known(folder, resolved, profile, site) if folder.exists() else None
        if job is None:
            keep_copies(files, folder)
            job = _prepared(folder, data, resolved, checked.run, chosen, site.bin)
        number = slurm.submit(site.bin, folder, job, batch.profile_of(site, job.profile)[1])
        noted = batch.Job(**{**{name: getattr(job, name) for name in job.__struct_fields__}, "job": number})
        whole.write(folder / layout.JOB, batch.to_json(noted))
    except slurm_call.AwayError as error:
        raise ClientError(
            f"{error}; it is unknown whether Slurm has made a job: repeat the command to find out"
        ) from None
    except (slurm_call.SlurmError, ValueError) as error:
        raise ClientError(str(error)) from None
    except OSError as error:
        raise ClientError(f"{error.filename or folder}: {error.strerror}") from None
    return Handed(folder, number, job.profile, job.attempt)


def _known(folder: Path, resolved: bytes, profile: str, site: Slurm) -> Job | None:
    """Returns the record of the job that was submitted before for a folder. A lost job is replaced by a new job.
    Raises ClientError if the folder belongs to another case, or if its job has another profile than ``profile``.
    """
    job = job_of(folder)
    if job is None:
        if any(folder.iterdir()):
            raise ClientError(
                f"{folder}: the folder is not empty and has no run of Slurm; choose another folder with --out"
            )
        return None
    if (folder / layout.OUTCOME).exists():
        raise ClientError(f"{folder}: the run in this folder has ended; choose another folder with --out")
    if resolved_json(parse_case(json.loads((folder / _CASE).read_bytes()))) != resolved:
        raise ClientError(
            f"{folder}: this folder was submitted to Slurm with another case, other ranks or threads; choose "
            "another folder with --out"
        )
    if profile not in ("", job.profile):
        raise ClientError(
            f"{folder}: this folder was submitted to Slurm with the profile {job.profile!r}; choose another folder "
            "with --out"
        )
    chosen = batch.profile_of(site, job.profile)
    command = _command(folder, job.ranks, job.threads, chosen[1])
    known = slurm.jobs(site.bin, job.name)
    if not job.job or any(entry.state not in slurm.FINAL for entry in known) or slurm.held(folder):
        return _written(folder, msgspec.structs.replace(job, command=command, bin=site.bin), chosen[1])
    (folder / layout.STOP_REQUEST).unlink(missing_ok=True)
    fresh = batch.new_job(folder.name, job.ranks, chosen, command, time.time(), job.attempt + 1, site.bin, job.threads)
    return _written(folder, fresh, chosen[1])


def _prepared(
    folder: Path, data: dict[str, Any], resolved: bytes, run: Run, profile: tuple[str, batch.Profile], place: str
) -> Job:  # fmt: skip
    """Creates the run folder; the folder is complete on disk before Slurm gets the job."""
    (folder / layout.LOGS).mkdir(parents=True, exist_ok=True)
    case = folder / _CASE
    case.write_text(json.dumps(data, indent=2, default=str), encoding="utf-8")
    (folder / layout.RESOLVED_CASE).write_bytes(resolved)
    command = _command(folder, run.ranks, run.threads, profile[1])
    job = batch.new_job(folder.name, run.ranks, profile, command, time.time(), place=place, threads=run.threads)
    queued = messages.Status(run=folder.name, seq=1, wall=time.time(), state=State.QUEUED, message="handed to Slurm")
    (folder / layout.JOURNAL).write_bytes(messages.to_json(queued) + b"\n")
    return _written(folder, job, profile[1])


def _command(folder: Path, ranks: int, threads: int, profile: batch.Profile) -> list[str]:
    """Returns the command that starts the ranks. The command is computed again for each job, because a record in a
    folder must not choose the program that runs.
    """
    worker = [sys.executable, "-P", "-m", "mpi4py", "-m", "conoid.worker", str(folder / _CASE), "--out", str(folder)]
    words = ["--run", folder.name, "--ranks", str(ranks), "--interruptible"]
    return [*batch.starter(profile, ranks, _mpiexec, threads), *worker, *words]


def _written(folder: Path, job: Job, profile: batch.Profile) -> Job:
    """Writes the record and the script of a job to disk."""
    whole.write(folder / layout.JOB_SCRIPT, batch.script(profile, sys.executable).encode(), 0o755)
    whole.write(folder / layout.JOB, batch.to_json(job))
    return job


def _mpiexec() -> list[str]:
    beside = Path(sys.executable).with_name("mpiexec")
    found = str(beside) if beside.is_file() else shutil.which("mpiexec")
    if found is None:
        raise ClientError("no mpiexec: install conoid[mpich], or name the mpiexec of the site in the profile")
    return [found]


def cancel_folder(folder: Path) -> str:
    """Cancels the run in a folder and its waiting job; returns one line about the result.

    The Slurm commands are taken from the settings file of the site, or from PATH. A job is cancelled only if Slurm
    has a job with the number and the name of the record. Raises UnfinishedError if the folder is not that of a run,
    ClientError, OSError.
    """
    LocalFolder(folder).path(layout.JOURNAL)
    if (folder / layout.OUTCOME).exists():
        return f"{folder} has ended"
    job = job_of(folder)
    if job is None and not slurm.held(folder):
        return f"{folder}: no worker writes into this folder; cancel a run of a server by its id"
    whole.touch(folder / layout.STOP_REQUEST)
    if job is None or not job.job:
        return f"{folder} is requested to stop"
    place = slurm_of(None).bin
    try:
        listed = [one for one in slurm.jobs(place, job.name) if (one.job, one.name) == (job.job, job.key)]
        if not listed:
            return f"{folder} is requested to stop; Slurm has no job {job.job} of the name {job.name}"
        slurm.notify(place, listed[0])
    except slurm_call.SlurmError as error:
        return f"{folder} is requested to stop; Slurm does not answer: {error}"
    return f"{folder} is requested to stop, job {job.job}"
