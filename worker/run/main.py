"""Start of the worker: arguments, case, run folder, outcome. The exit codes are in cases/run.py."""

import argparse
import logging
import os
import sys
import time
import traceback
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from conoid.cases import load, messages
from conoid.cases import outcome as outcomes
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Outcome
from conoid.cases.output import layout
from conoid.cases.reading import whole
from conoid.cases.reading.problems import CaseError
from conoid.cases.run import Cause, ExitCode, State
from conoid.cases.warnings.plausible import bare_numbers

from ..errors import CompileError, ConoidError, StoppedError
from ..kernels import compile as ahead
from ..kernels import store
from ..output import storage
from ..output.journal import Journal
from ..output.spoken import Speaker
from ..parallel.comm import Comm
from ..parallel.mpi import abort, connect
from . import heap
from .lock import hold
from .signals import Signals

if TYPE_CHECKING:
    from ..output.telemetry import Telemetry

log = logging.getLogger("conoid.worker")

_WRONG_SIZE = "MPI has started {} rank(s) instead of {}: mpiexec or srun (--mpi=pmi2) does not fit the MPI in use"

_CODES = {
    State.SUCCEEDED: ExitCode.SUCCEEDED,
    State.FAILED: ExitCode.PHYSICS,
    State.CANCELLED: ExitCode.INTERRUPTED,
    State.TIMED_OUT: ExitCode.INTERRUPTED,
}


def main(arguments: list[str]) -> int:
    """Runs one case on all ranks of MPI's world. Returns the exit code of the process."""
    began = time.monotonic()
    heap.tidy()
    options = _parse(arguments)
    signals = Signals()
    comm = connect()
    try:
        return _run(options, comm, signals, began)
    except BaseException as error:
        if log.hasHandlers():  # the log goes into the run's folder, which already exists
            log.error("rank %d stops the job\n%s", comm.rank, traceback.format_exc())
        if storage.failed(error) or storage.gone(error, options.out):
            named = "" if isinstance(error, OSError) and error.filename else f" (in {options.out})"
            print(f"a file of the run was removed or cannot be written: {error}{named}", file=sys.stderr, flush=True)
            abort(ExitCode.STORAGE)
        raise


def _run(options: argparse.Namespace, comm: Comm, signals: Signals, began: float) -> int:
    if options.ranks is not None and comm.size != options.ranks:
        print(_WRONG_SIZE.format(comm.size, options.ranks), file=sys.stderr)
        return ExitCode.CRASHED
    lock = _prepare_folder(options.out, comm)
    if lock is None:
        print(f"{options.out}: another worker writes into this folder", file=sys.stderr)
        return ExitCode.CRASHED
    with lock:
        if options.restart and comm.broadcast(_succeeded(options.out) if comm.rank == 0 else False):
            print(f"--restart: {options.out} has succeeded and has nothing left to do", file=sys.stderr)
            return ExitCode.BAD_INPUT
        return _worked(options, comm, signals, began)


def _succeeded(folder: Path) -> bool:
    """Returns whether the run in a folder has succeeded. The outcome of a run that has succeeded must not be
    replaced.
    """
    try:
        return State(outcomes.from_json(whole.read(folder / layout.OUTCOME)).state) is State.SUCCEEDED
    except (OSError, ValueError):
        return False


def _worked(options: argparse.Namespace, comm: Comm, signals: Signals, began: float) -> int:
    telemetry = journal = speaker = None
    if comm.rank == 0:
        telemetry = _telemetry(options)
        speaker = Speaker(options.out) if options.run is None else None
        journal = Journal(options.out, options.run or options.out.resolve().name, telemetry or speaker)
    outcome, code = _outcome(options, comm, journal, signals, began)
    if journal is not None:
        _close(outcome, options, journal, telemetry)
    if speaker is not None:
        speaker.close(outcome)
    comm.barrier()
    return code


def _telemetry(options: argparse.Namespace) -> "Telemetry | None":
    """Opens the Zenoh session. Only rank 0 imports Zenoh."""
    if not options.telemetry:
        return None
    from ..output.telemetry import Telemetry

    return Telemetry(options.telemetry, options.prefix)


def _outcome(
    options: argparse.Namespace, comm: Comm, journal: Journal | None, signals: Signals, began: float
) -> tuple[Outcome, int]:
    """Runs the case. Returns its outcome and exit code. An error of the case or of the run gives an outcome with the
    state failed."""
    try:
        case, warnings = _case(options, comm)
        if comm.rank == 0:
            (options.out / layout.RESOLVED_CASE).write_bytes(load.resolved_json(case))
        if journal is not None:
            for text in warnings:
                journal.write(messages.Log, level="warning", text=text)
        outcome = _compute(case, options, comm, journal, signals, began)
        outcome = msgspec.structs.replace(outcome, warnings=[*warnings, *outcome.warnings])
        return outcome, _CODES[State(outcome.state)]
    except CaseError as error:
        return _unbegun(State.FAILED, Cause.INPUT, str(error), comm, began), ExitCode.BAD_INPUT
    except ConoidError as error:
        return _unbegun(error.state, error.cause, str(error), comm, began), error.exit_code


def _unbegun(state: State, cause: Cause, message: str, comm: Comm, began: float) -> Outcome:
    elapsed = time.monotonic() - began
    return Outcome(state=state, cause=cause, message=message, ranks=comm.size, elapsed=elapsed)


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="conoid.worker", description="Run one case.")
    parser.add_argument("case", help="a .toml or .json file, or the name of a shipped case")
    parser.add_argument("--out", type=Path, required=True, help="the run folder")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the case")
    parser.add_argument("--restart", action="store_true", help="continue from the latest checkpoint in the run folder")
    parser.add_argument("--run", help="the run's id; the folder's name when absent")
    parser.add_argument("--telemetry", metavar="ENDPOINT", help="a Zenoh router, such as tcp/127.0.0.1:7447")
    parser.add_argument("--ranks", type=int, help="end at once when MPI has started another number of ranks")
    parser.add_argument("--threads", type=int, help="threads of each rank; run.threads of the case when absent")
    parser.add_argument(
        "--use", choices=("chosen", "all", "project"), default="chosen",
        help="use of the threads: as many as make the run faster; all; one, which measures each task and estimates "
        "the time with more threads (default: chosen)",
    )  # fmt: skip
    parser.add_argument(
        "--interruptible", action="store_true",
        help=f"a stop that {layout.STOP_REQUEST} does not request leaves a checkpoint and no outcome",
    )  # fmt: skip
    parser.add_argument("--prefix", help="key prefix of the run, conoid/v1/<owner>/<run>")
    options = parser.parse_args(arguments)
    if (options.telemetry is None) != (options.prefix is None):
        parser.error("--telemetry and --prefix go together")
    return options


def _case(options: argparse.Namespace, comm: Comm) -> tuple[Case, list[str]]:
    """Returns the case with its overrides, and warnings about its text. The number of ranks in the case is set to the
    number that MPI has started.

    Rank 0 reads the case. All ranks receive the case, or raise the error of rank 0.
    """
    found: tuple[Case, list[str]] | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        try:
            found = _read(options, comm.size)
        except (CaseError, OSError) as error:
            failure = error
    found, failure = comm.broadcast((found, failure))
    if failure is not None:
        raise failure
    assert found is not None
    return found


def _file(name: str) -> Path:
    """Returns the path of the file of a case. ``name`` is a path, or the name of a shipped case. Raises CaseError."""
    path = Path(name)
    return load.shipped_path(name) if not path.exists() and not path.suffix else path


def _read(options: argparse.Namespace, ranks: int) -> tuple[Case, list[str]]:
    data = load.apply_overrides(load.read_data(_file(options.case)), options.set)
    there = {"run.ranks": ranks} | ({} if options.threads is None else {"run.threads": options.threads})
    return load.parse_case(load.apply_overrides(data, there)), [str(each) for each in bare_numbers(data)]


def _prepare_folder(folder: Path, comm: Comm) -> AbstractContextManager[Any] | None:
    """Locks the run's folder. Returns the open lock file on rank 0, and an empty context on the other ranks.

    Returns None on every rank if another worker has the lock."""
    held: AbstractContextManager[Any] | None = nullcontext()
    if comm.rank == 0:
        (folder / layout.LOGS).mkdir(parents=True, exist_ok=True)
        held = hold(folder)
        if (
            held is not None and (folder / layout.OUTCOME).exists()
        ):  # an old request to stop belongs to an earlier attempt
            (folder / layout.STOP_REQUEST).unlink(missing_ok=True)
    if not comm.broadcast(held is not None):
        return None
    logging.basicConfig(
        filename=layout.rank_log(folder, comm.rank), level=logging.INFO,
        format="%(asctime)s %(levelname)s %(message)s", force=True,
    )  # fmt: skip
    log.info("rank %d of %d, process %d", comm.rank, comm.size, os.getpid())
    return held


def _compute(
    case: Case, options: argparse.Namespace, comm: Comm, journal: Journal | None, signals: Signals, began: float
) -> Outcome:
    ready_kernels(comm, journal)
    from . import compute

    meshes = _file(options.case).resolve().parent  # relative paths of mesh files begin at the folder of the case
    return compute.compute(case, meshes, options.out, comm, journal, signals, began, options.restart, options.use)


def ready_kernels(comm: Comm, journal: Journal | None) -> None:
    """Ensures that all ranks use the same kernels. Rank 0 hashes the sources and compiles missing kernels; the other
    ranks wait.

    The function must be called before numba is imported. Raises CompileError, StoppedError on all ranks.
    """
    failure: ConoidError | None = None
    if comm.rank == 0:
        try:
            ahead.compile_all(store.cache_folder(), lambda done, total: _report(journal, ahead.words(done, total)))
        except (CompileError, StoppedError) as error:
            failure = error
    comm.await_all()
    sources, failure = comm.broadcast((store.source_hash(), failure) if comm.rank == 0 else None)
    if failure is not None:
        raise failure
    store.use_cache(sources)


def _report(journal: Journal | None, what: str) -> None:
    """Reports a phase of the start-up."""
    log.info(what)
    if journal is not None:
        journal.starting(what)


def _close(outcome: Outcome, options: argparse.Namespace, journal: Journal, telemetry: "Telemetry | None") -> None:
    """Writes the outcome, then the last message. A reader of the last message therefore finds the outcome on disk.

    If the run was interrupted, this function writes no last message, because worker/run/job.py finds the cause of the
    interruption.
    """
    interrupted = options.interruptible and outcome.state == State.CANCELLED
    if interrupted and not (options.out / layout.STOP_REQUEST).exists():
        whole.write(options.out / layout.INTERRUPTED, outcomes.to_json(outcome))
    else:
        whole.write(options.out / layout.OUTCOME, outcomes.to_json(outcome))
        journal.write(messages.Finished, **outcomes.last_message(outcome))
    journal.close()
    if telemetry is not None:
        telemetry.close()
    if outcome.message:
        print(outcome.message, file=sys.stderr)
