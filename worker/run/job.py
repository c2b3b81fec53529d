"""``python -m conoid.worker.run.job FOLDER NAME``: one attempt of a run inside a job of a batch system.

The script of the job becomes this process. The process starts the ranks, sends the signal of the batch system to them,
and finds the cause of the signal. If the job was cancelled, the run ends. After a preemption or a time limit the same
job is queued again, and the run resumes from its checkpoint. If the cause is unknown, the folder gets a checkpoint and
no outcome. If there is no outcome, the server or the command that submitted the job decides whether the run continues.
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
"""Longest time for which Slurm's controller is asked for the cause of a signal, s. Chosen value: KillWait, 30 s by
default, after which Slurm ends this process."""
_EARLY = 90.0
"""Longest time between the signal and the time limit of a job, s: Slurm may send the signal 60 s early (sbatch(1)),
plus a margin for the checkpoint."""


@dataclass
class Relay:
    """Handler that sends the signal TERM of the batch system to the ranks as USR1. The signal is not sent as TERM,
    because srun takes a TERM as a request to end itself.
    """

    child: "subprocess.Popen[bytes] | None" = None
    raised: bool = False

    def listen(self) -> None:
        """Installs the handlers of the signals."""
        for number in (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT):
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: object) -> None:
        self.raised = True
        self.send()

    def send(self) -> None:
        """Sends USR1 to the ranks if they are running."""
        if self.child is not None and self.child.poll() is None:
            self.child.send_signal(signal.SIGUSR1)


def main(arguments: list[str]) -> int:
    """Runs the ranks and returns their exit code. Returns 0 if another job runs this case, or if this job is queued
    again.
    """
    relay = Relay()
    relay.listen()
    folder, number, name = *_place(Path(arguments[0]), os.environ), arguments[1]
    if os.path.samestat(os.fstat(1), os.stat(os.devnull)):
        _write_into(folder)
    job = batch.read_job(folder)
    if job is None or job.name != name or not claim(folder, job, number):
        print(f"job {number}: another job runs this case", flush=True)
        return 0
    if (folder / layout.OUTCOME).exists():
        print(f"job {number}: this run has already ended", flush=True)
        return 0
    if (folder / layout.STOP_REQUEST).exists():
        end(folder, job, Outcome(state=State.CANCELLED, cause=Cause.CANCELLED, message="cancelled before it started"))
        return 0
    before = latest(folder)
    code = _run(folder, job, number, relay)
    if (folder / layout.OUTCOME).exists() or not (relay.raised or code == ExitCode.INTERRUPTED):
        return code
    return _interrupted(folder, job, number, latest(folder) > before) or code


def _place(given: Path, env: Mapping[str, str]) -> tuple[Path, str]:
    """Returns the run's folder, and the number of the job as the queue shows it.

    A task of a job array finds its folder by its index. After the call the output of the process is written into the
    log of the folder of the run. Raises OSError.
    """
    task = env.get("SLURM_ARRAY_TASK_ID", "")
    if not task or not (given / layout.ARRAY).exists():
        return given, env.get("SLURM_JOB_ID", str(os.getpid()))
    folder = Path(msgspec.json.decode((given / layout.ARRAY).read_bytes(), type=list[str])[int(task)])
    _write_into(folder)
    return folder, f"{env['SLURM_ARRAY_JOB_ID']}_{task}"


def _write_into(folder: Path) -> None:
    """Directs the output of this process and of the ranks into the log of the run. Raises OSError."""
    log = os.open(folder / layout.LOGS / layout.LAUNCHER_LOG, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    for stream in (1, 2):
        os.dup2(log, stream)
    os.close(log)


def claim(folder: Path, job: Job, number: str) -> bool:
    """Returns True if this is the first job of this name that starts, or the same job in a new attempt."""
    path = layout.claim(folder, job.name)
    beside = path.with_name(f"{path.name}.{number}.{os.getpid()}")
    beside.write_text(number)
    with suppress(FileExistsError):
        os.link(beside, path)
    beside.unlink()
    return path.read_text() == number


def latest(folder: Path) -> int:
    """Returns the step of the newest checkpoint; -1 if there is no checkpoint."""
    return next((int(place.name) for place in checkpoints.found(folder)), -1)


def _run(folder: Path, job: Job, number: str, relay: Relay) -> int:
    """Starts the ranks and waits for their end, without a time limit after a signal. Returns their exit code."""
    (folder / layout.INTERRUPTED).unlink(missing_ok=True)
    again = int(os.environ.get("SLURM_RESTART_COUNT", "0"))
    attempt = f"attempt {job.attempt + again}" if job.attempt + again > 1 else figures.crew(job.ranks, job.threads)
    where = os.environ.get("SLURM_JOB_NODELIST", "?")
    _report(folder, job, State.STARTING, f"Slurm job {number} on {where}, {attempt}")
    access = batch.read_access(folder)
    words = [*job.command, *(["--restart"] if latest(folder) >= 0 else [])]
    if access is not None:
        words += ["--telemetry", access.endpoint, "--prefix", access.prefix]
    relay.child = subprocess.Popen(words, stdin=subprocess.DEVNULL, env=environment(os.environ, job, access))
    if relay.raised:
        relay.send()
    code = relay.child.wait()
    return code if code >= 0 else 128 - code


def environment(base: Mapping[str, str], job: Job, access: batch.Access | None) -> dict[str, str]:
    """Returns the environment of the ranks, which contains settings for libraries (one thread each), the run's id, and
    the run's Zenoh credentials.
    """
    env = {**base, **dict.fromkeys(_ONE_THREAD, "1"), "CONOID_RUN": job.run}
    if access is not None and access.user:
        env |= {"CONOID_ZENOH_USER": access.user, "CONOID_ZENOH_PASSWORD": access.password}
    if access is not None and access.authority:
        env["CONOID_ZENOH_AUTHORITY"] = access.authority
    return env


def _interrupted(folder: Path, job: Job, number: str, further: bool) -> int | None:
    """Acts on the cause of the signal. Returns None if the exit code of the ranks is valid.

    ``further``: whether the ranks have written a newer checkpoint.
    """
    if (folder / layout.STOP_REQUEST).exists():
        return _cancelled(folder, job, "stopped on request")
    verdict = judge(_details(job.bin, number), int(os.environ.get("SLURM_RESTART_COUNT", "0")), job.notice, time.time())
    if verdict == "cancelled":
        return _cancelled(folder, job, f"Slurm job {number} was cancelled")
    if verdict == "outside":
        message = f"Slurm job {number} got a signal that neither its owner nor Slurm has sent"
        end(folder, job, _so_far(folder, State.FAILED, Cause.PREEMPTED, message))
        return ExitCode.INTERRUPTED
    if verdict == "time limit" and not further:
        message = "the job's time limit came before a new checkpoint"
        end(folder, job, _so_far(folder, State.TIMED_OUT, Cause.WALLTIME, message))
        return ExitCode.INTERRUPTED
    if verdict == "unknown":
        _report(folder, job, State.QUEUED, f"job {number} was interrupted; the next job continues from its checkpoint")
        return None
    why = "the time limit is near" if verdict == "time limit" else "preempted"
    _report(folder, job, State.QUEUED, f"{why}; job {number} is queued again and continues from its checkpoint")
    return _requeue(job.bin, number) if verdict != "requeued" else 0


def judge(found: Mapping[str, str], restarts: int, notice: float, now: float) -> str:
    """Returns the cause of the batch system's signal: ``cancelled``, ``time limit``, ``preempted``, ``requeued`` (Slurm
    has queued the job again by itself), ``outside`` (another sender) or ``unknown``.

    ``found``: fields of scontrol for the job; ``restarts``: number of times that Slurm had restarted the job before;
    ``notice``: seconds between the signal and the time limit; ``now``: seconds since 1970.
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
    return "cancelled" if found.get("JobState") in {"CANCELLED", "COMPLETING"} else "outside"


def _seconds(text: str) -> float | None:
    """Converts a duration such as ``1-02:03:04`` to s. Returns None if there is no limit."""
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


def _requeue(place: str, number: str) -> int | None:
    try:
        slurm.requeue(place, number)
    except slurm_call.SlurmError as error:
        print(f"job {number}: it cannot be queued again: {error}", flush=True)
        return None
    return 0


def _cancelled(folder: Path, job: Job, message: str) -> int:
    end(folder, job, _so_far(folder, State.CANCELLED, Cause.CANCELLED, message))
    return ExitCode.INTERRUPTED


def _so_far(folder: Path, state: State, cause: Cause, message: str) -> Outcome:
    """Returns the outcome that the interrupted ranks have written, after the cause of the interruption in it is
    corrected.
    """
    try:
        found = outcome.from_json(whole.read(folder / layout.INTERRUPTED))
    except (OSError, msgspec.MsgspecError):
        found = Outcome(state=state)
    return msgspec.structs.replace(found, state=state, cause=cause, message=message)


def end(folder: Path, job: Job, ended: Outcome) -> None:
    """Writes the outcome and the last message of the run. Raises OSError."""
    lock = hold(folder)
    last = msgspec.structs.replace(ended, ranks=job.ranks, threads=job.threads)
    whole.write(folder / layout.OUTCOME, outcome.to_json(last))
    (folder / layout.INTERRUPTED).unlink(missing_ok=True)
    journal = Journal(folder, job.run)
    journal.write(messages.Finished, **outcome.last_message(last))
    journal.close()
    if lock is not None:
        lock.close()


def _report(folder: Path, job: Job, state: State, message: str) -> None:
    journal = Journal(folder, job.run)
    journal.write(messages.Status, state=state, message=message)
    journal.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
