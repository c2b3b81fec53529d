"""Runs of a sweep that are submitted together are one job array of Slurm: one sbatch command with one task for each
run.

Before sbatch is called, the record of each run gets the name of the job array and the index of its task. After a crash
the server reads these records, and submits the tasks that Slurm does not have.
"""

import logging
import secrets
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.site import batch, slurm, slurm_call

from .slurm_run import SlurmWorker

_log = logging.getLogger("conoid.server")
_SETTLES = 0.5
"""Time in s without a new run after which a group of runs is submitted; the runs of a sweep are made some milliseconds
apart (reason of the chosen value)."""
_MOST = 1000
"""Largest number of tasks of a job array. The default of Slurm's MaxArraySize is 1001 (slurm.conf(5))."""


class Arrays:
    """Groups of runs that are submitted as job arrays. The class is used only in the launcher's thread."""

    def __init__(self, runs: Path, site: batch.Slurm) -> None:
        """Creates the object. ``runs``: the folder of all runs."""
        self._place, self._site = runs / layout.ARRAYS, site

    def hand_over(self, workers: Iterable[SlurmWorker]) -> set[str]:
        """Submits the groups that are complete. Returns the names of the runs that still wait for their group. Raises
        AwayError or OSError.
        """
        fresh: dict[tuple[object, ...], list[SlurmWorker]] = {}
        known: dict[str, list[SlurmWorker]] = {}
        for worker in workers:
            job = worker.record
            if worker.waits_for_array:
                known.setdefault(job.name, []).append(worker)
            elif worker.fresh:
                fresh.setdefault((worker.group, job.profile, job.ranks, job.threads), []).append(worker)
        growing = {each.name for group in fresh.values() if not _settled(group) for each in group}
        for group in fresh.values():
            if _settled(group) and len(group) > 1:
                members = group[:_MOST]
                known[self._join(members)] = members
        for members in known.values():
            self._submit(members)
        return growing

    def _join(self, members: Sequence[SlurmWorker]) -> str:
        """Writes the record of a job array, and its name into the record of each of its runs."""
        word = "".join(letter if letter.isalnum() else "_" for letter in members[0].group)[:60]
        name = f"conoid-{word}-{secrets.token_hex(4)}"
        folder = self._place / name
        folder.mkdir(0o700, parents=True)
        profile = batch.profile_of(self._site, members[0].record.profile)[1]
        folders = [str(worker.folder) for worker in members]
        whole.write(folder / layout.ARRAY, msgspec.json.encode(folders))
        whole.write(folder / layout.JOB_SCRIPT, batch.script(profile, sys.executable).encode(), 0o755)
        for task, worker in enumerate(members):
            worker.write_down(name=name, task=task, array=str(folder))
        return name

    def _submit(self, members: Sequence[SlurmWorker]) -> None:
        records = [worker.record for worker in members]
        profile = batch.profile_of(self._site, records[0].profile)[1]
        try:
            numbers = slurm.submit_array(self._site.bin, records, profile)
        except slurm_call.LaterError as error:
            for worker in members:
                worker.wait(str(error))
            return
        except slurm_call.RefusedError as error:
            _log.warning("Slurm refuses the array %s; its runs are submitted singly: %s", records[0].name, error)
            for worker in members:
                worker.leave_array()
            return
        for worker, record in zip(members, records, strict=True):
            if record.task is not None:
                worker.write_down(job=numbers[record.task])


def _settled(group: Sequence[SlurmWorker]) -> bool:
    return time.monotonic() > max(worker.since for worker in group) + _SETTLES
