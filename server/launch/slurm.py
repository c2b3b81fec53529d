"""Workers as jobs of Slurm. The commands of Slurm run in a thread of the launcher, so that only this thread waits if
the controller of Slurm does not answer.
"""

import logging
import sys
import threading
import time
from collections.abc import Set
from functools import partial
from pathlib import Path

import msgspec

from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.slurm import Entry

from ..settings import Settings
from . import DamagedError, Job, LaunchError, Trace
from .accounting import Accounting
from .arrays import Arrays
from .local import find_mpiexec
from .slurm_run import SlurmWorker

_log = logging.getLogger("conoid.server")


class SlurmLauncher:
    """Launcher for Slurm. ``start`` writes the record of a job to disk. The thread then submits exactly one job for
    each record, and tries again after failures.
    """

    queues = True

    def __init__(self, settings: Settings, site: batch.Slurm) -> None:
        """Creates the launcher without a thread; the thread starts with the first run."""
        self._mpiexec, self._worker, self._site = settings.mpiexec, settings.worker, site
        self._arrays, self._accounting = Arrays(settings.runs, site), Accounting(site.bin)
        self._workers: dict[str, SlurmWorker] = {}
        self._lock, self._thread = threading.Lock(), threading.Thread(target=self._work, name="slurm", daemon=True)

    def start(self, job: Job) -> SlurmWorker:
        """Writes the record of a job that is to be submitted. Raises LaunchError if the record cannot be written."""
        try:
            profile = batch.profile_of(self._site, job.profile)
            starter = batch.starter(profile[1], job.ranks, partial(find_mpiexec, self._mpiexec), job.threads)
            command = [*starter, *self._words(job)]
            record = batch.new_job(
                job.run, job.ranks, profile, command, time.time(), place=self._site.bin, threads=job.threads
            )
            if job.telemetry is not None:
                self._write_access(job)
            whole.write(job.folder / layout.JOB_SCRIPT, batch.script(profile[1], sys.executable).encode(), 0o755)
            whole.write(job.folder / layout.JOB, batch.to_json(record))
        except (OSError, ValueError) as error:
            failed = DamagedError if isinstance(error, OSError) else LaunchError
            raise failed(f"the record of the job cannot be written: {error}") from None
        return self._take(job.run, SlurmWorker(job.folder, record, self._site, job.group, self._accounting))

    def find(self, run: str, folder: Path) -> Trace:
        """Finds the job of a run by its record. An earlier server has submitted the job, or has only written the record
        before it ended. Raises OSError or ValueError.
        """
        try:
            record = batch.read_job(folder)
        except msgspec.MsgspecError as error:
            raise ValueError(f"{layout.JOB}: {error}") from None
        if record is None:
            return Trace(None, False, False)
        return Trace(self._take(run, SlurmWorker(folder, record, self._site, accounting=self._accounting)), True, False)

    def tidy(self) -> None:
        """Does nothing, because Slurm cleans its nodes."""

    def _words(self, job: Job) -> list[str]:
        words = [*self._worker, str(job.case), "--out", str(job.folder), "--run", job.run, "--ranks", str(job.ranks)]
        words += ["--threads", str(job.threads)]
        if job.wall_time is not None:
            words += ["--set", f"run.max_wall_time={job.wall_time!r}"]
        return [*words, "--interruptible"]

    def _write_access(self, job: Job) -> None:
        assert job.telemetry is not None
        telemetry = job.telemetry
        access = batch.Access(
            endpoint=self._site.router or telemetry.endpoint, prefix=telemetry.prefix, user=telemetry.user,
            password=telemetry.password, authority=self._site.authority,
        )  # fmt: skip
        whole.write(job.folder / layout.ACCESS, batch.to_json(access), 0o600)

    def _take(self, run: str, worker: SlurmWorker) -> SlurmWorker:
        with self._lock:
            self._workers[run] = worker
            if not self._thread.is_alive():
                self._thread.start()
        return worker

    # The thread -------------------------------------------------------------------------------------------------------

    def _work(self) -> None:
        while True:
            try:
                self._round()
            except Exception:
                _log.exception("Slurm is queried again in %g s", self._site.poll)
            time.sleep(self._site.poll)

    def _round(self) -> None:
        """Reads the list of jobs from Slurm once for all runs, then performs the next action of each run."""
        with self._lock:
            self._workers = {run: worker for run, worker in self._workers.items() if not worker.over}
            workers = list(self._workers.items())
        if not workers:
            return
        try:
            found: dict[str, list[Entry]] = {}
            names = sorted({worker.record.name for _, worker in workers})
            for entry in slurm.jobs(self._site.bin, *names):
                found.setdefault(entry.name, []).append(entry)
        except slurm_call.SlurmError as error:
            _log.warning("Slurm does not answer: %s", error)
            for _, worker in workers:
                worker.silent(str(error))
            return
        growing = self._hand_over_arrays([worker for _, worker in workers])
        arrays = {entry.job.partition("_")[0] for same in found.values() for entry in same if "_" in entry.job}
        for run, worker in workers:
            if worker.name not in growing and not self._attend(run, worker, found.get(worker.name, []), arrays):
                return

    def _hand_over_arrays(self, workers: list[SlurmWorker]) -> set[str]:
        """Submits complete groups of runs as job arrays. Returns the names of the runs that must not be submitted alone
        at present.
        """
        try:
            return self._arrays.hand_over(workers)
        except (slurm_call.SlurmError, OSError) as error:
            _log.warning("a job array is submitted later: %s", error)
            return {worker.name for worker in workers if worker.fresh or worker.waits_for_array}

    def _attend(self, run: str, worker: SlurmWorker, entries: list[Entry], arrays: Set[str]) -> bool:
        """Performs the next action of one run. Returns False if the controller of Slurm has not answered; the thread
        then does not wait again for another run. A command that hangs is not repeated at once.
        """
        try:
            worker.turn(entries, arrays)
        except slurm_call.SlurmError as error:
            _log.warning("run %s: Slurm does not answer: %s", run, error)
            worker.silent(str(error))
            return isinstance(error, slurm_call.AwayError) and error.command not in {"squeue", "sbatch"}
        except (OSError, ValueError) as error:
            _log.error("run %s: %s", run, error)
        return True
