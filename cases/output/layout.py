"""The files in the folder of a run. All of these files can be read without the server.

::

    <runs>/<id>/
      case.toml | case.json  as submitted          case.resolved.json  with every default, in SI units
      submission.json        user, time and key of the submission          worker.json  the process that runs it
      journal.jsonl          every message, one JSON line each, numbered by seq
      history.csv            time history: clock, ledger, probes; history.parquet at the end, if pyarrow is installed
      frames/000012.vtkhdf   one file per frame    frames/frames.vtkhdf.series  for ParaView
      snapshots/000012.snap  surface and table of the fragments (snapshot.py); snapshot.request requests one
      snapshots/000012.tets  all tets, compressed, for sections; not for every snapshot
      checkpoints/000001200/ complete state, by global ids; checkpoint.request requests one
      job.json, job.sh       the job of a batch system that runs it (cases/site/batch.py); stop.request ends it
      files/<sha256>.inp     the run's own copies of the files that its case names (cases/reading/files.py)
      log/rank-0.log         one per rank          log/launcher.log
      report.html            the run in one file (report.py), on request to a server
      outcome.json           written last
"""

from pathlib import Path

RESOLVED_CASE = "case.resolved.json"
JOURNAL = "journal.jsonl"
HISTORY = "history.csv"
HISTORY_PARQUET = "history.parquet"
OUTCOME = "outcome.json"
FRAMES = "frames"
FRAME_SERIES = "frames.vtkhdf.series"
CHECKPOINTS = "checkpoints"
CHECKPOINT_REQUEST = "checkpoint.request"
"""Name of the file that requests a checkpoint; the worker removes the file."""
SNAPSHOTS = "snapshots"
TETS_SUFFIX = ".tets"
SNAPSHOT_REQUEST = "snapshot.request"
"""Name of the file that requests a snapshot; the worker removes the file."""
FILES = "files"
LOGS = "log"
LAUNCHER_LOG = "launcher.log"
SUBMISSION = "submission.json"
"""Name of a file about the submission of a run. Only the server writes this file and ``worker.json``; the folder of a
run without a server has neither of the two."""
WORKER = "worker.json"
JOB = "job.json"
"""Name of the record of a job, which the server or the command line writes when it submits the run to a batch system.
"""
JOB_SCRIPT = "job.sh"
ACCESS = ".telemetry.json"
"""Name of a hidden file that only its owner can read: the network address and the token with which the ranks of a job
publish messages."""
STOP_REQUEST = "stop.request"
"""Name of the file that requests the final stop of a run. The worker does not remove it. The server writes the cause of
the stop into this file, one word. If a job is stopped and this file does not exist, the run is interrupted and will
continue."""
INTERRUPTED = "interrupted.json"
"""Name of the preliminary outcome of a run that was interrupted and will continue."""
ARRAYS = ".arrays"
"""Name of a folder beside the folders of the runs. The folder ``.arrays`` has one folder per job array, with the script
and the list of runs of the array."""
ARRAY = "folders.json"
"""Name of the file that lists the run folders of the tasks of a job array, in the order of the tasks."""
LOCK = ".lock"
"""Name of the lock file that rank 0 locks while it writes into the folder of the run."""


def frame(folder: Path, index: int) -> Path:
    """Path of frame ``index`` in the run folder ``folder``."""
    return folder / FRAMES / f"{index:06d}.vtkhdf"


def set_array(name: str) -> str:
    """Name of the point array of a frame that marks the nodes of a set. HDF5 separates groups by "/"; the name
    therefore has the character U+2215 in place of "/".
    """
    return "set_" + name.replace("/", "\u2215")


def checkpoint(folder: Path, step: int) -> Path:
    """Path of the checkpoint before ``step`` in the run folder ``folder``."""
    return folder / CHECKPOINTS / f"{step:09d}"


def snapshot(folder: Path, n: int) -> Path:
    """Path of the snapshot with number ``n`` in the run folder ``folder``."""
    return folder / SNAPSHOTS / f"{n:06d}.snap"


def snapshot_tets(folder: Path, n: int) -> Path:
    """Path of the file with all tets of snapshot ``n`` in the run folder ``folder``."""
    return snapshot(folder, n).with_suffix(TETS_SUFFIX)


def share(folder: Path, n: int, rank: int) -> Path:
    """Path of the contribution of one rank to snapshot ``n``. The file is removed when the snapshot is made."""
    return folder / SNAPSHOTS / f".{n:06d}.{rank}"


def rank_log(folder: Path, rank: int) -> Path:
    """Path of the log of ``rank`` in the run folder ``folder``."""
    return folder / LOGS / f"rank-{rank}.log"


def claim(folder: Path, job_name: str) -> Path:
    """Path of the file that the first job with the name ``job_name`` creates; the file contains the number of that job.
    A second job with the same name finds the file and ends.
    """
    return folder / f".claim-{job_name}"
