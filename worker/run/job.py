"""``python -m conoid.worker.run.job FOLDER NAME``: one attempt of a run inside a job of a batch system.

The script of the job becomes this process. It starts the ranks, tells them when the batch system wants the cores back,
and says what that was: a cancel, which ends the run, or a preemption or a time limit, after which the same job waits
for its turn again and the run goes on from its checkpoint. What it cannot find out it leaves to who has handed the job
over: the folder then holds a checkpoint and no outcome.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases import figures, messages, outcome
from conoid.cases.outcome import Outcome
from conoid.cases.output import checkpoints, layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, ExitCode, State
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.batch import Job

from ..output.journal import Journal
from .lock import hold

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_ASK_FOR = 20.0
"""s for which the controller is asked what has happened. Chosen: KillWait, 30 s by default, ends this process."""
_EARLY = 90.0
"""s by which Slurm may send the signal before it is due (60, sbatch(1)), and some for the checkpoint."""


@dataclass
class Told:
    """Passes the batch system's TERM on to the ranks: as USR1, because srun takes a TERM for its own end."""

    child: "subprocess.Popen[bytes] | None" = None
    raised: bool = False

    def listen(self) -> None:
        """From now on."""
        for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT):
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: object) -> None:
        self.raised = True
        self.tell()

    def tell(self) -> None:
        """Tells the ranks."""
        if self.child is not None and self.child.poll() is None:
            self.child.send_signal(signal.SIGUSR1)


def main(arguments: list[str]) -> int:
    """The exit code of the job: that of the ranks; 0 when another job has the run, or when it waits again."""
    told = Told()
    told.listen()
    folder, number, name = *_place(Path(arguments[0]), os.environ), arguments[1]
    if os.path.samestat(os.fstat(1), os.stat(os.devnull)):
        _write_into(folder)
    job = batch.read_job(folder)
    if job is None or job.name != name or not claim(folder, job, number):
        print(f"job {number}: another job has this run", flush=True)
        return 0
    if (folder / layout.OUTCOME).exists():
        print(f"job {number}: this run has ended; the controller has forgotten that it was started", flush=True)
        return 0
    if (folder / layout.STOP_REQUEST).exists():
        end(folder, job, Outcome(state=State.CANCELLED, cause=Cause.CANCELLED, message="cancelled before it started"))
        return 0
    before = latest(folder)
    code = _run(folder, job, number, told)
    if (folder / layout.OUTCOME).exists() or not (told.raised or code == ExitCode.INTERRUPTED):
        return code
    return _interrupted(folder, job, number, latest(folder) > before) or code


def _place(given: Path, env: Mapping[str, str]) -> tuple[Path, str]:
    """The run's folder, and the number of the job as the queue has it. A task of an array finds its folder by its
    place, and from then on writes into that folder's log. Raises OSError.
    """
    task = env.get("SLURM_ARRAY_TASK_ID", "")
    if not task or not (given / layout.ARRAY).exists():
        return given, env.get("SLURM_JOB_ID", str(os.getpid()))
    folder = Path(msgspec.json.decode((given / layout.ARRAY).read_bytes(), type=list[str])[int(task)])
    _write_into(folder)
    return folder, f"{env['SLURM_ARRAY_JOB_ID']}_{task}"


def _write_into(folder: Path) -> None:
    """What this process and the ranks print goes to the launcher's log of the run. Raises OSError."""
    log = os.open(folder / layout.LOGS / layout.LAUNCHER_LOG, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    for stream in (1, 2):
        os.dup2(log, stream)
    os.close(log)


def claim(folder: Path, job: Job, number: str) -> bool:
    """True for the first job of this name that starts, and for the same one when it is started again."""
    path = layout.claim(folder, job.name)
    beside = path.with_name(f"{path.name}.{number}.{os.getpid()}")
    beside.write_text(number)
    with suppress(FileExistsError):
        os.link(beside, path)
    beside.unlink()
    return path.read_text() == number


def latest(folder: Path) -> int:
    """The step of the newest checkpoint; -1 when there is none."""
    return next((int(place.name) for place in checkpoints.found(folder)), -1)


def _run(folder: Path, job: Job, number: str, told: Told) -> int:
    """Starts the ranks and waits for their end, however long it takes after a signal."""
    (folder / layout.INTERRUPTED).unlink(missing_ok=True)
    again = int(os.environ.get("SLURM_RESTART_COUNT", "0"))
    attempt = f"attempt {job.attempt + again}" if job.attempt + again > 1 else figures.crew(job.ranks, job.threads)
    _say(folder, job, State.STARTING, f"Slurm job {number} on {os.environ.get('SLURM_JOB_NODELIST', '?')}, {attempt}")
    access = batch.read_access(folder)
    words = [*job.command, *(["--restart"] if latest(folder) >= 0 else [])]
    if access is not None:
        words += ["--telemetry", access.endpoint, "--prefix", access.prefix]
    told.child = subprocess.Popen(words, stdin=subprocess.DEVNULL, env=environment(os.environ, job, access))
    if told.raised:
        told.tell()
    code = told.child.wait()
    return code if code >= 0 else 128 - code


def environment(base: Mapping[str, str], job: Job, access: batch.Access | None) -> dict[str, str]:
    """Of the ranks: libraries with one thread, the run's mark, its credentials."""
    env = {**base, **dict.fromkeys(_ONE_THREAD, "1"), "CONOID_RUN": job.run}
    if access is not None and access.user:
        env |= {"CONOID_ZENOH_USER": access.user, "CONOID_ZENOH_PASSWORD": access.password}
    if access is not None and access.authority:
        env["CONOID_ZENOH_AUTHORITY"] = access.authority
    return env


def _interrupted(folder: Path, job: Job, number: str, further: bool) -> int | None:
    """Settles what the signal was; None when that is left to others. ``further``: there is a new checkpoint."""
    if (folder / layout.STOP_REQUEST).exists():
        return _cancelled(folder, job, "stopped on request")
    verdict = judge(_details(job.bin, number), int(os.environ.get("SLURM_RESTART_COUNT", "0")), job.notice, time.time())
    if verdict == "cancelled":
        return _cancelled(folder, job, f"Slurm job {number} was cancelled")
    if verdict == "nobody":
        message = f"Slurm job {number} was told to stop from outside, neither by its owner nor by Slurm"
        end(folder, job, _so_far(folder, State.FAILED, Cause.PREEMPTED, message))
        return ExitCode.INTERRUPTED
    if verdict == "time limit" and not further:
        message = "the job's time limit came before a checkpoint that is newer than the last"
        end(folder, job, _so_far(folder, State.TIMED_OUT, Cause.WALLTIME, message))
        return ExitCode.INTERRUPTED
    if verdict == "unknown":
        _say(folder, job, State.QUEUED, f"job {number} was interrupted; a next one goes on from its checkpoint")
        return None
    why = "the time limit is near" if verdict == "time limit" else "preempted"
    _say(folder, job, State.QUEUED, f"{why}; job {number} waits again and goes on from its checkpoint")
    return _again(job.bin, number) if verdict != "requeued" else 0


def judge(found: Mapping[str, str], restarts: int, notice: float, now: float) -> str:
    """What the batch system has meant by its signal: ``cancelled``, ``time limit``, ``preempted``, ``requeued`` (it
    has put the job back by itself), ``nobody`` (the signal came from elsewhere) or ``unknown``; from what scontrol
    says of the job that was started ``restarts`` times before.
    """
    if not found:
        return "unknown"
    if int(found.get("Restarts", "0")) > restarts:
        return "requeued"
    if found.get("PreemptTime", "None") not in {"None", "Unknown", "(null)"}:
        return "preempted" if found.get("JobState") == "RUNNING" else "unknown"
    limit = _seconds(found.get("TimeLimit", ""))
    start = found.get("StartTime", "")
    if limit is not None and start.isdigit() and now >= int(start) + limit - notice - _EARLY:
        return "time limit" if found.get("JobState") == "RUNNING" else "unknown"
    return "cancelled" if found.get("JobState") in {"CANCELLED", "COMPLETING"} else "nobody"


def _seconds(text: str) -> float | None:
    """``1-02:03:04`` in s; None for no limit."""
    days, _, clock = text.rpartition("-")
    parts = clock.split(":")
    if not all(part.isdigit() for part in (*parts, days or "0")):
        return None
    return int(days or 0) * 86400.0 + sum(int(part) * 60.0**place for place, part in enumerate(reversed(parts)))


def _details(place: str, number: str) -> dict[str, str]:
    deadline = time.monotonic() + _ASK_FOR
    while time.monotonic() < deadline:
        try:
            return slurm.details(place, number)
        except slurm_call.SlurmError:
            time.sleep(1.0)
    return {}


def _again(place: str, number: str) -> int | None:
    try:
        slurm.requeue(place, number)
    except slurm_call.SlurmError as error:
        print(f"job {number}: it cannot be put back: {error}", flush=True)
        return None
    return 0


def _cancelled(folder: Path, job: Job, message: str) -> int:
    end(folder, job, _so_far(folder, State.CANCELLED, Cause.CANCELLED, message))
    return ExitCode.INTERRUPTED


def _so_far(folder: Path, state: State, cause: Cause, message: str) -> Outcome:
    """The outcome that the interrupted ranks have left, with its true reason."""
    try:
        found = outcome.from_json(whole.read(folder / layout.INTERRUPTED))
    except (OSError, msgspec.MsgspecError):
        found = Outcome(state=state)
    return msgspec.structs.replace(found, state=state, cause=cause, message=message)


def end(folder: Path, job: Job, ended: Outcome) -> None:
    """The outcome, and the last message. Raises OSError."""
    lock = hold(folder)
    last = msgspec.structs.replace(ended, ranks=job.ranks, threads=job.threads)
    whole.write(folder / layout.OUTCOME, outcome.to_json(last))
    (folder / layout.INTERRUPTED).unlink(missing_ok=True)
    journal = Journal(folder, job.run)
    journal.write(messages.Finished, **outcome.last_message(last))
    journal.close()
    if lock is not None:
        lock.close()


def _say(folder: Path, job: Job, state: State, message: str) -> None:
    journal = Journal(folder, job.run)
    journal.write(messages.Status, state=state, message=message)
    journal.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
