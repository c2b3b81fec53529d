"""A run that was submitted to Slurm. The job name identifies the run. How the run has ended is read from its folder;
why it waits is read from Slurm.
"""

import time
from collections.abc import Mapping, Set
from pathlib import Path

import msgspec

from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.run import Cause, State
from conoid.cases.site import batch, slurm, slurm_call
from conoid.cases.site.batch import Job
from conoid.cases.site.slurm import Entry

from . import Exit, Phase
from .accounting import Accounting
from .job_end import exit_of

_LAG = 5.0
"""Time in s after the end of a job for which its last files may still be missing on a network file system (chosen
value)."""
_LATE = 10.0
"""Time in s without new data in a folder with an outcome, after which the run has ended for every state that Slurm
reports (chosen value)."""
_MOST = 20
"""Largest number of jobs that are submitted for one run (chosen value). A further job is submitted only if Slurm has
lost the previous one."""
_RELEASES = 3
"""Largest number of times that a job is released after a node has failed to start it (chosen value). A node that is
busy or restarting will work later; a broken node will not."""
_POLITE, _LONGEST_PAUSE = 2.0, 60.0
"""Delays in s before a request to Slurm is repeated after a temporary refusal: the first and the largest delay (chosen
values)."""


class SlurmWorker:
    """A run as a job of Slurm. The methods before ``turn`` may be called from any thread and do not wait; only the
    thread of the launcher calls ``turn``.
    """

    def __init__(
        self, folder: Path, job: Job, site: batch.Slurm, group: str = "", accounting: Accounting | None = None
    ) -> None:  # fmt: skip
        """Creates the worker. ``job``: record of a new job, or of a job that an earlier server has submitted or
        recorded. ``group``: name of the runs that may be one job array, for a run that was never submitted.
        """
        self.folder = self._folder = folder
        self._job, self._site, self._accounting = job, site, accounting or Accounting()
        self.group, self.since = group, time.monotonic()
        self._entry: Entry | None = None
        self._exit: Exit | None = None
        self._stop, self._kill, self._notified = (folder / layout.STOP_REQUEST).exists(), False, ""
        self._missing, self._ended, self._away, self._why = 0, 0.0, 0.0, ""
        self._released = 0
        self._later, self._pause, self._not_before = "", _POLITE, 0.0

    @property
    def name(self) -> str:
        """Name of the job with the index of its task; it is unique."""
        return self._job.key

    @property
    def record(self) -> Job:
        """Record of the job in the run's folder."""
        return self._job

    @property
    def fresh(self) -> bool:
        """Whether the run was never submitted, so that it may become a task of a job array."""
        return bool(self.group) and not self._job.job and not self._stop

    @property
    def waits_for_array(self) -> bool:
        """Whether the run will be submitted as a task of a job array."""
        waits = not self._job.job and self._job.task is not None and not self._stop and self._exit is None
        return waits and time.monotonic() >= self._not_before

    # From any thread --------------------------------------------------------------------------------------------------

    def phase(self) -> Phase:
        """Returns the state of the job in the last job list of Slurm."""
        entry = self._entry
        if entry is None:
            return "unknown" if self._job.job else "waits"
        return "waits" if entry.state in slurm.PENDING else "runs"

    def began(self) -> float:
        """Returns the Unix time of the last start of the job, s."""
        entry = self._entry
        return entry.start if entry is not None and entry.state not in slurm.PENDING else 0.0

    def note(self) -> str:
        """Returns the reason why the job waits, or the time since which Slurm does not answer."""
        entry, number = self._entry, self._job.job
        if self._away:
            last = f"; before that, job {number} was {entry.state.lower()}" if entry else ""
            return f"unknown: Slurm has not answered for {time.monotonic() - self._away:.0f} s ({self._why}){last}"
        if self._later and entry is None:
            return f"Slurm accepts no job now; the job is submitted again later: {self._later}"
        if entry is None:
            return f"waiting for the answer of Slurm about job {number}" if number else "is being handed to Slurm"
        return f"Slurm job {number} is pending: {entry.reason}" if entry.state in slurm.PENDING else ""

    def exited(self) -> Exit | None:
        """Returns the end of the run; None while its job waits or runs. If its folder has an outcome and no new data,
        the run has ended even if Slurm does not answer.
        """
        return self._exit or (Exit(None, False, "") if self._complete() else None)

    def _complete(self) -> bool:
        try:
            age = time.time() - (self._folder / layout.OUTCOME).stat().st_mtime
            return (bool(self._away) or age > _LATE) and not slurm.held(self._folder)
        except OSError:
            return False

    def stop(self) -> None:
        """Asks the run to stop, by a file in its folder. The launcher's thread then cancels a pending job, or sends a
        signal to a running job. Raises OSError if this file cannot be written.
        """
        (self._folder / layout.STOP_REQUEST).touch()
        self._stop = True

    def kill(self) -> None:
        """Requests that the launcher's thread kills the job."""
        self._stop = self._kill = True

    # The launcher's thread --------------------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """Whether no further command of Slurm is needed for the run."""
        return self._exit is not None

    def silent(self, why: str) -> None:
        """Records that Slurm does not answer; the last state of the job stays."""
        self._away, self._why = self._away or time.monotonic(), why

    def turn(self, entries: list[Entry], arrays: Set[str] = frozenset()) -> None:
        """Performs the next action of the run. ``entries``: the jobs with the name of this run in the list of Slurm;
        ``arrays``: the numbers of all job arrays in the list. Raises SlurmError or OSError.

        The start of a job may get lost when the controller of Slurm crashes; this method then submits the job again.
        """
        self._away = 0.0
        if self.waits_for_array or (self._job.task is not None and not self._job.job and not self._stop):
            return
        self.group = ""
        if not self._job.job:
            self._hand_over()
            return
        entry = self._chosen(entries)
        if entry is None:
            self._look_for_it(arrays)
            return
        self._missing, self._entry = 0, entry
        if entry.state in slurm.FINAL:
            self._end(entry)
        elif entry.state in slurm.PENDING and (self._folder / layout.OUTCOME).exists():
            slurm.cancel(self._site.bin, entry.job)
            self._exit = Exit(None, False, "")
        elif entry.not_launched and not self._stop:
            self._launch_again(entry)
        elif self._kill:
            slurm.kill(self._site.bin, entry.job)
        elif self._stop and self._notified != entry.state:
            slurm.notify(self._site.bin, entry)
            self._notified = entry.state

    def _launch_again(self, entry: Entry) -> None:
        """Releases a job that Slurm holds because a node has failed to start it."""
        if self._released < _RELEASES:
            self._released += 1
            slurm.release(self._site.bin, entry.job)
            return
        slurm.cancel(self._site.bin, entry.job)
        why = f"no node has started Slurm job {entry.job}, which was released {_RELEASES} times"
        self._exit = Exit(None, False, "", (State.LOST, Cause.NODE, why))

    def _hand_over(self) -> None:
        if self._stop:
            known = [entry for entry in slurm.jobs(self._site.bin, self._job.name) if entry.name == self._job.key]
            if known:
                self.write_down(job=known[0].job)
            else:
                self._exit = Exit(None, False, "")
            return
        if time.monotonic() < self._not_before:
            return
        profile = batch.profile_of(self._site, self._job.profile)[1]
        try:
            self.write_down(job=slurm.submit(self._site.bin, self._folder, self._job, profile))
            self._later, self._pause = "", _POLITE
        except slurm_call.LaterError as error:
            self.wait(str(error))
        except slurm_call.RefusedError as error:
            self._exit = Exit(None, False, "", (State.FAILED, Cause.LAUNCH, f"Slurm refuses the job: {error}"))

    def wait(self, why: str) -> None:
        """Delays the next request after a temporary refusal; the delay doubles each time."""
        self._later, self._not_before = why, time.monotonic() + self._pause
        self._pause = min(2.0 * self._pause, _LONGEST_PAUSE)

    def leave_array(self) -> None:
        """Submits the run as a job of its own, because Slurm has refused the job array. Raises OSError."""
        job, self.group = self._job, ""
        profile = batch.profile_of(self._site, job.profile)
        fresh = batch.new_job(
            job.run, job.ranks, profile, job.command, job.submitted, job.attempt, job.bin, job.threads
        )
        self.write_down(name=fresh.name, task=None, array="")

    def write_down(self, **changes: object) -> None:
        """Writes the record of the job; flushes the record to disk before the next action. Raises OSError."""
        job = msgspec.structs.replace(self._job, **changes)
        whole.write(self._folder / layout.JOB, batch.to_json(job))
        self._job = job

    def _chosen(self, entries: list[Entry]) -> Entry | None:
        """Returns the running job, otherwise the first job. A second job, which a crash of the controller can cause, is
        cancelled.
        """
        begun = slurm.begun(self._folder, self._job) if len(entries) > 1 else ""
        ordered = sorted(entries, key=lambda entry: (entry.job != begun, entry.state in slurm.FINAL, entry.job))
        for extra in ordered[1:]:
            if extra.state not in slurm.FINAL:
                slurm.cancel(self._site.bin, extra.job)
        if ordered and ordered[0].job != self._job.job:
            self.write_down(job=ordered[0].job)
        return ordered[0] if ordered else None

    def _look_for_it(self, arrays: Set[str]) -> None:
        """Handles a list of Slurm that does not contain the job; acts only after the second such list in a row."""
        self._missing += 1
        if self._missing < 2 or slurm.held(self._folder):
            return
        if (self._folder / layout.OUTCOME).exists():
            self._exit = Exit(None, False, "")
        elif slurm.begun(self._folder, self._job):
            self._again("Slurm has forgotten the job")
        elif self._array_number in arrays or self._others_began():
            why = f"Slurm job {self._job.job} was cancelled while it waited"
            self._exit = Exit(None, False, "", (State.CANCELLED, Cause.CANCELLED, why))
        else:
            self._missing = 0
            self.write_down(job="")

    @property
    def _array_number(self) -> str:
        """Returns the number of the job array to which the job belongs."""
        number, task, _ = self._job.job.partition("_")
        return number if task else ""

    def _others_began(self) -> bool:
        """Whether another task of the job array has started; Slurm has then stored the whole array. A task that was
        cancelled while it waited is not in the list.
        """
        if not self._array_number:
            return False
        folders = msgspec.json.decode(whole.read(Path(self._job.array) / layout.ARRAY), type=list[str])
        begun = (slurm.begun(Path(folder), self._job) for folder in folders)
        return any(number.partition("_")[0] == self._array_number for number in begun)

    def _end(self, entry: Entry) -> None:
        """Handles the end of a job. The cause of the end is read from the files in the run's folder."""
        self._ended = self._ended or time.monotonic()
        there = (self._folder / layout.OUTCOME).exists()
        begun = bool(slurm.begun(self._folder, self._job))
        if not there and begun and (slurm.held(self._folder) or time.monotonic() - self._ended < _LAG):
            return
        self.write_down(accounting=slurm.accounting(self._site.bin, entry.job))
        left = (self._folder / layout.INTERRUPTED).exists() and entry.state != "CANCELLED"
        if not there and (left or entry.state in {"PREEMPTED", "NODE_FAIL", "BOOT_FAIL"}):
            self._again(f"job {entry.job} ended as {entry.state}")
        else:
            self._exit = exit_of(self._folder, self._job, entry)
            self._accounting.note(self, entry.job)

    def took(self, found: Mapping[str, str]) -> None:
        """Stores the usage of the last job of the run, as the accounting database has reported it. Raises OSError if
        the data cannot be stored.
        """
        self.write_down(accounting={**self._job.accounting, **found})

    def _again(self, why: str) -> None:
        """Submits another job, which continues from the last checkpoint, unless a stop of the run was requested."""
        if self._stop or self._job.attempt >= _MOST:
            self._exit = Exit(None, False, "", (State.LOST, Cause.NODE, f"{why}, attempt {self._job.attempt}"))
            return
        profile = batch.profile_of(self._site, self._job.profile)
        job, attempt = self._job, self._job.attempt + 1
        fresh = batch.new_job(job.run, job.ranks, profile, job.command, time.time(), attempt, job.bin, job.threads)
        whole.write(self._folder / layout.JOB, batch.to_json(fresh))
        self._job, self._entry, self._ended, self._missing, self._notified = fresh, None, 0.0, 0, ""
        self._released = 0
