"""Workers on this machine. The launcher runs ``mpiexec`` in a session of its own, so that workers continue after the
server has ended.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from conoid.cases.estimates.cores import core_numbers, usable_cores
from conoid.cases.output import checkpoints, layout
from conoid.cases.reading import whole

from ..runs import folder as run_folder
from ..runs import launcher_log
from ..runs.folder import Process
from ..settings import Settings, command
from . import DamagedError, Exit, Job, LaunchError, Phase, Trace, Worker, memory, processes

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_NOT_FOR_WORKERS = ("CONOID_DATABASE", "CONOID_TOKEN")
_CROWDED = 4
"""Number of ranks per core from which on waiting ranks of MPICH sleep and do not poll."""
_KILL_WAIT = 1.0
"""Time in s to wait for the end of a launcher that was killed, so that no zombie process stays (chosen value; it ends
within milliseconds)."""
_FRESH = 1.0
"""Time in s for which a list of all processes is used before it is read again (chosen value). The list is needed for
workers that an earlier server has started."""
_HOUR = 3600.0
"""Age in s of shared memory that no process uses, after which it is removed (chosen value). A new run uses its shared
memory long before."""


class LocalLauncher:
    """Starts ``mpiexec -n N <worker> CASE --out DIR ...``."""

    queues = False

    def __init__(self, settings: Settings) -> None:
        """Reads the launcher command and the worker command from ``settings``."""
        self._mpiexec, self._worker = settings.mpiexec, settings.worker
        self._living: dict[str, set[int]] = {}
        self._looked = -_FRESH
        self._kills = memory.Kills()

    def start(self, job: Job) -> Worker:
        """Starts the ranks. The terminal output of the ranks is written to log/launcher.log. Raises LaunchError if the
        ranks cannot be started.
        """
        bound = [] if self._mpiexec else binding(job.ranks, job.threads, core_numbers())
        argv = [*find_mpiexec(self._mpiexec), *bound, "-n", str(job.ranks), *self._worker, *_arguments(job)]
        with _log_of(job.folder) as log:
            try:
                child = subprocess.Popen(
                    argv, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, cwd=job.folder,
                    env=environment(os.environ, job), start_new_session=True,
                )  # fmt: skip
            except OSError as error:
                raise LaunchError(f"{argv[0]} cannot be started: {error.strerror}") from None
        worker = LocalWorker(job.run, job.folder, _record(child.pid), self._kills, child)
        try:
            run_folder.write_process(job.folder, worker.process)
        except OSError as error:
            worker.kill()
            raise DamagedError(f"the worker cannot be recorded: {error.strerror}") from None
        return worker

    def find(self, run: str, folder: Path) -> Trace:
        """Finds the worker of a run by its record in the run's folder. If a server was killed before it wrote the
        record, finds it by the environment of its processes.
        """
        process = run_folder.process(folder)
        if process is None:
            leader = processes.leader_of(self._members(run))
            if leader is None:
                return Trace(None, False, False)
            process = _record(leader)
            with suppress(OSError):
                run_folder.write_process(folder, process)
        worker = LocalWorker(run, folder, process, self._kills)
        rebooted = process.boot != processes.boot()
        return Trace(worker if not rebooted and worker.alive() else None, True, rebooted)

    def _members(self, run: str) -> set[int]:
        """Returns the process numbers of a run. All runs use the same list of processes, so that a thousand runs read
        /proc only once.
        """
        if time.monotonic() > self._looked + _FRESH:
            self._living, self._looked = processes.of_all_runs(), time.monotonic()
        return self._living.get(run, set())

    def tidy(self) -> None:
        """Removes shared memory of MPICH that killed ranks have left, 2 MB for each run."""
        for path in processes.unused_shared_memory(Path("/dev/shm"), "mpich_shm_", _HOUR):
            path.unlink(missing_ok=True)


def _log_of(folder: Path) -> BinaryIO:
    """Opens the log of the launcher; creates the folder of the log if it is missing."""
    try:
        (folder / layout.LOGS).mkdir(0o700, exist_ok=True)
        return whole.appended(folder / layout.LOGS / layout.LAUNCHER_LOG)
    except OSError as error:
        raise DamagedError(f"{layout.LOGS} cannot be written: {error.strerror}") from None


def find_mpiexec(chosen: str) -> tuple[str, ...]:
    """Returns the command of mpiexec: that of the site; else that beside this Python; else that in PATH. Raises
    LaunchError if there is none.
    """
    if chosen:
        return command(chosen, "--mpiexec")
    beside = Path(sys.executable).with_name("mpiexec")
    found = str(beside) if beside.is_file() else shutil.which("mpiexec")
    if found is None:
        raise LaunchError("no mpiexec was found: install conoid[mpich], or name the site's own with --mpiexec")
    return (found,)


def binding(ranks: int, threads: int, cores: Sequence[int]) -> list[str]:
    """Returns the options of MPICH's mpiexec that bind each rank to its own cores. If the run does not use all
    ``cores``, there are no such options, because other runs may use any of the cores.
    """
    if ranks == 1 or threads == 1 or ranks * threads != len(cores):
        return []
    shares = (cores[first : first + threads] for first in range(0, len(cores), threads))
    return ["-bind-to", "user:" + ",".join("+".join(map(str, share)) for share in shares)]


def environment(base: Mapping[str, str], job: Job) -> dict[str, str]:
    """Returns the environment variables of a worker: one thread for the libraries, the id of the run, and the
    credentials for Zenoh. Variables for the server itself are not among them.
    """
    env = {name: value for name, value in base.items() if name not in _NOT_FOR_WORKERS}
    env.update(dict.fromkeys(_ONE_THREAD, "1"))
    env[processes.RUN_VARIABLE] = job.run
    env.setdefault("HYDRA_LAUNCHER", "fork")
    env.setdefault("HYDRA_IFACE", "lo")
    if job.ranks >= _CROWDED * usable_cores():
        env.setdefault("MPIR_CVAR_ENABLE_HEAVY_YIELD", "1")
    if job.telemetry is not None and job.telemetry.user:
        env["CONOID_ZENOH_USER"], env["CONOID_ZENOH_PASSWORD"] = job.telemetry.user, job.telemetry.password
    return env


def _arguments(job: Job) -> list[str]:
    arguments = [str(job.case), "--out", str(job.folder), "--run", job.run, "--ranks", str(job.ranks)]
    arguments += ["--threads", str(job.threads)]
    if checkpoints.found(job.folder):
        arguments.append("--restart")
    if job.telemetry is not None:
        arguments += ["--telemetry", job.telemetry.endpoint, "--prefix", job.telemetry.prefix]
    return arguments


def _record(pid: int) -> Process:
    started = processes.start_time(pid) or 0
    return Process(pid=pid, started=started, boot=processes.boot(), launched=time.time())


class LocalWorker:
    """A worker on this machine, started by this server or by an earlier server."""

    def __init__(
        self, run: str, folder: Path, process: Process, kills: memory.Kills,
        child: subprocess.Popen[bytes] | None = None,
    ) -> None:  # fmt: skip
        """Creates the worker. ``child``: the process object, if this server has started the worker."""
        self._run, self._folder, self._kills, self._child = run, folder, kills, child
        self.process = process

    def alive(self) -> bool:
        """True while ``mpiexec`` runs."""
        if self._child is not None:
            return self._child.poll() is None
        return processes.start_time(self.process.pid) == self.process.started

    def phase(self) -> Phase:
        """Always ``runs``: a local run has its cores from the start."""
        return "runs"

    def began(self) -> float:
        """Returns the Unix time of the launch, s."""
        return self.process.launched

    def note(self) -> str:
        """Returns an empty text: a local worker has no remark."""
        return ""

    def exited(self) -> Exit | None:
        """Returns the end of the worker; None while ``mpiexec`` runs. Ranks that still run after the end of ``mpiexec``
        are killed, so that no process writes into the run's folder afterwards.
        """
        self._kills.count()
        if self.alive() or processes.end_run(self._run):
            return None
        starved = self._kills.ended(launcher_log.rank_killed(self._folder) or self.process.pid)
        return Exit(self._child.returncode if self._child else None, starved, launcher_log.last_words(self._folder))

    def stop(self) -> None:
        """Sends SIGTERM to ``mpiexec``, which forwards it to every rank."""
        if self.alive():
            with suppress(ProcessLookupError):
                os.kill(self.process.pid, signal.SIGTERM)

    def kill(self) -> None:
        """Sends SIGKILL to the process group of ``mpiexec``, then to all other processes of the run."""
        if self.alive():
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
        processes.end_run(self._run)
        if self._child is not None:
            with suppress(subprocess.TimeoutExpired):
                self._child.wait(_KILL_WAIT)
