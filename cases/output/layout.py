"""The files in a run's folder: plain files, complete without the server.

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
"""Name of a file that only the server writes, like ``worker.json``. The folder of a run without a server has neither of
these two files."""
WORKER = "worker.json"
JOB = "job.json"
"""Name of a file that the server or the command line writes at the submission to a batch system."""
JOB_SCRIPT = "job.sh"
ACCESS = ".telemetry.json"
"""Name of a hidden file that only its owner can read: network address and token with which the ranks of a job
publish."""
STOP_REQUEST = "stop.request"
"""Name of the file that requests the final stop of the run; the file stays. The server writes the cause of the stop
into this file, as a word. If this file does not exist, the stop of a job is an interruption."""
INTERRUPTED = "interrupted.json"
"""Name of the preliminary outcome of a run that was interrupted and will continue."""
ARRAYS = ".arrays"
"""Folder beside the folders of the runs: one folder per job array, with the script and the list of runs of the
array."""
ARRAY = "folders.json"
"""Name of the list of the run folders of the tasks, in order."""
LOCK = ".lock"
"""Name of the lock that rank 0 holds while it writes into the folder."""


def frame(folder: Path, index: int) -> Path:
    """Path of frame ``index`` in the run folder ``folder``."""
    return folder / FRAMES / f"{index:06d}.vtkhdf"


def set_array(name: str) -> str:
    """Name of the point array of a set of nodes in a frame. HDF5 separates groups by "/"; therefore the name has U+2215
    instead of "/".
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
    """Path of the contribution of ``rank`` to snapshot ``n``; the file exists until the snapshot is made."""
    return folder / SNAPSHOTS / f".{n:06d}.{rank}"


def rank_log(folder: Path, rank: int) -> Path:
    """Path of the log of ``rank`` in the run folder ``folder``."""
    return folder / LOGS / f"rank-{rank}.log"


def claim(folder: Path, job_name: str) -> Path:
    """Path of the file that the first job with a given name creates, with the number of the job. A second job with the
    same name ends.
    """
    return folder / f".claim-{job_name}"
