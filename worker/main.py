"""Start-up of the worker: arguments, the case, the run folder, the outcome. Exit codes: cases/run.py."""

import argparse
import logging
import os
import sys
import time
import traceback
from pathlib import Path

from conoid.cases import layout, load, messages
from conoid.cases import outcome as outcomes
from conoid.cases.problems import CaseError
from conoid.cases.run import Cause, ExitCode, State
from conoid.cases.schema import Case

from .errors import ConoidError, InputError
from .output.journal import Journal
from .output.telemetry import Telemetry
from .parallel.comm import Comm, connect

log = logging.getLogger("conoid.worker")


def main(arguments: list[str]) -> int:
    """Runs one case on all ranks of MPI's world; returns the exit code of the process."""
    began = time.monotonic()
    options = _parse(arguments)
    comm = connect()
    folder: Path = options.out
    _prepare_folder(folder, comm)
    try:
        case = _case(options)
        if comm.size != case.run.ranks:
            case = case.model_copy(update={"run": case.run.model_copy(update={"ranks": comm.size})})
        return _run(case, options, comm, began)
    except CaseError as error:
        return _fail(folder, comm, State.FAILED, Cause.INPUT, str(error), ExitCode.BAD_INPUT)
    except InputError as error:
        return _fail(folder, comm, State.FAILED, error.cause, str(error), error.exit_code)


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="conoid.worker", description="Run one case.")
    parser.add_argument("case", help="a .toml or .json file, or the name of a shipped case")
    parser.add_argument("--out", type=Path, required=True, help="the run folder")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the case")
    parser.add_argument("--run", help="the run's id; the folder's name when absent")
    parser.add_argument("--telemetry", metavar="ENDPOINT", help="a Zenoh router, such as tcp/127.0.0.1:7447")
    parser.add_argument("--prefix", help="key prefix of the run, conoid/v1/<owner>/<run>")
    options = parser.parse_args(arguments)
    if (options.telemetry is None) != (options.prefix is None):
        parser.error("--telemetry and --prefix go together")
    return options


def _case(options: argparse.Namespace) -> Case:
    path = Path(options.case)
    if not path.exists() and options.case in load.shipped():
        path = load.shipped_path(options.case)
    return load.parse_case(load.apply_overrides(load.read_data(path), options.set))


def _prepare_folder(folder: Path, comm: Comm) -> None:
    if comm.rank == 0:
        (folder / layout.LOGS).mkdir(parents=True, exist_ok=True)
    comm.barrier()
    logging.basicConfig(
        filename=layout.rank_log(folder, comm.rank), level=logging.INFO,
        format="%(asctime)s %(levelname)s %(message)s", force=True,
    )  # fmt: skip
    log.info("rank %d of %d, process %d", comm.rank, comm.size, os.getpid())


def _run(case: Case, options: argparse.Namespace, comm: Comm, began: float) -> int:
    folder, run = options.out, options.run or options.out.resolve().name
    journal = telemetry = None
    if comm.rank == 0:
        telemetry = Telemetry(options.telemetry, options.prefix) if options.telemetry else None
        journal = Journal(folder, run, telemetry)
        (folder / layout.RESOLVED_CASE).write_bytes(load.resolved_json(case))
    try:
        outcome = _compute(case, _mesh_folder(options), folder, comm, journal, began)
    except ConoidError as error:
        if isinstance(error, InputError):
            raise
        outcome = outcomes.Outcome(
            state=State.FAILED, cause=error.cause, message=str(error), ranks=comm.size, elapsed=time.monotonic() - began
        )
    except BaseException:
        log.error("rank %d\n%s", comm.rank, traceback.format_exc())
        raise
    return _finish(outcome, folder, comm, journal, telemetry)


def _mesh_folder(options: argparse.Namespace) -> Path:
    return Path(options.case).resolve().parent


def _compute(
    case: Case, meshes: Path, folder: Path, comm: Comm, journal: Journal | None, began: float
) -> outcomes.Outcome:
    if comm.rank == 0:
        from . import compute
    comm.barrier()
    if comm.rank != 0:
        from . import compute
    return compute.compute(case, meshes, folder, comm, journal, began)


def _finish(
    outcome: outcomes.Outcome, folder: Path, comm: Comm, journal: Journal | None, telemetry: Telemetry | None
) -> int:
    if comm.rank == 0 and journal is not None:
        _write_outcome(folder, outcome)
        journal.write(
            messages.Finished, outcome.steps, outcome.time, state=outcome.state, digest=outcome.digest,
            steps=outcome.steps, elapsed=outcome.elapsed,
        )  # fmt: skip
        journal.close()
        if telemetry is not None:
            telemetry.close()
        if outcome.message:
            print(outcome.message, file=sys.stderr)
    comm.barrier()
    return _exit_code(outcome)


def _exit_code(outcome: outcomes.Outcome) -> int:
    if outcome.state == State.SUCCEEDED:
        return ExitCode.SUCCEEDED
    return ExitCode.INTERRUPTED if outcome.state in (State.CANCELLED, State.TIMED_OUT) else ExitCode.PHYSICS


def _fail(folder: Path, comm: Comm, state: State, cause: Cause, message: str, code: int) -> int:
    if comm.rank == 0:
        _write_outcome(folder, outcomes.Outcome(state=state, cause=cause, message=message, ranks=comm.size))
        print(message, file=sys.stderr)
    comm.barrier()
    return code


def _write_outcome(folder: Path, outcome: outcomes.Outcome) -> None:
    """Written beside, flushed to disk, renamed: it is there whole or not at all."""
    beside = folder / (layout.OUTCOME + ".part")
    with beside.open("wb") as file:
        file.write(outcomes.to_json(outcome))
        file.flush()
        os.fsync(file.fileno())
    beside.rename(folder / layout.OUTCOME)
