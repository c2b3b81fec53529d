"""Names in a run's folder: plain files that stay complete without the server.

::

    <runs>/<id>/
      case.toml | case.json  as submitted          case.resolved.json  every default filled in, SI
      submission.json        who submitted it, when, with which key        worker.json  the process that runs it
      journal.jsonl          every event, one JSON line each, with seq: the truth
      history.csv            time history: clock, ledger, probes; history.parquet at the end, where pyarrow is there
      frames/000012.vtkhdf   one file a frame      frames/frames.vtkhdf.series  for ParaView
      snapshots/000012.snap  surface and table of the fragments (snapshot.py); snapshot.request asks for one
      snapshots/000012.tets  all tets in few bytes, for sections; not of every snapshot
      checkpoints/000001200/ complete state, by global ids; checkpoint.request asks for one
      job.json, job.sh       the job of a batch system that runs it (cases/site/batch.py); stop.request ends it for good
      files/<sha256>.inp     the run's own copies of the files that its case names (cases/reading/files.py)
      log/rank-0.log         one a rank            log/launcher.log
      report.html            the run in one file (report.py), where a server was asked for it
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
"""Whoever makes this file asks the worker for a checkpoint; the worker takes it away."""
SNAPSHOTS = "snapshots"
TETS_SUFFIX = ".tets"
SNAPSHOT_REQUEST = "snapshot.request"
"""Whoever makes this file asks the worker for a snapshot; the worker takes it away."""
FILES = "files"
LOGS = "log"
LAUNCHER_LOG = "launcher.log"
SUBMISSION = "submission.json"
"""Written by the server only, as is ``worker.json``: a run without a server has neither."""
WORKER = "worker.json"
JOB = "job.json"
"""Written by who hands the run to a batch system: the server, or the command line."""
JOB_SCRIPT = "job.sh"
ACCESS = ".telemetry.json"
"""Hidden, for its owner alone: where the ranks of a job publish, and as whom."""
STOP_REQUEST = "stop.request"
"""Whoever makes this file asks the run to stop for good; it stays. The server writes the cause into it, as a word.
A stop without it is an interruption to a job."""
INTERRUPTED = "interrupted.json"
"""The outcome so far of a run that was interrupted and is to go on."""
ARRAYS = ".arrays"
"""Beside the folders of the runs: a folder for each job array, with its script and the list of its runs."""
ARRAY = "folders.json"
"""The run's folder of each task, in order."""
LOCK = ".lock"
"""Held by rank 0 while it writes into the folder."""


def frame(folder: Path, index: int) -> Path:
    """Path of frame ``index`` in the run folder ``folder``."""
    return folder / FRAMES / f"{index:06d}.vtkhdf"


def checkpoint(folder: Path, step: int) -> Path:
    """Path of the checkpoint before ``step`` in the run folder ``folder``."""
    return folder / CHECKPOINTS / f"{step:09d}"


def snapshot(folder: Path, n: int) -> Path:
    """Path of snapshot ``n`` in the run folder ``folder``."""
    return folder / SNAPSHOTS / f"{n:06d}.snap"


def snapshot_tets(folder: Path, n: int) -> Path:
    """Path of all tets of snapshot ``n`` in the run folder ``folder``."""
    return snapshot(folder, n).with_suffix(TETS_SUFFIX)


def share(folder: Path, n: int, rank: int) -> Path:
    """What ``rank`` gives for snapshot ``n``; it is there until the snapshot is made."""
    return folder / SNAPSHOTS / f".{n:06d}.{rank}"


def rank_log(folder: Path, rank: int) -> Path:
    """Path of the log of ``rank`` in the run folder ``folder``."""
    return folder / LOGS / f"rank-{rank}.log"


def claim(folder: Path, job_name: str) -> Path:
    """Made by the first job of that name that starts; holds its number. A second one ends."""
    return folder / f".claim-{job_name}"
