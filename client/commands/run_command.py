"""The command ``conoid run``: it runs one case on this machine, from the check of the case to a picture."""

import signal
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.console import Console

from conoid.cases.estimates.cores import usable_cores
from conoid.cases.figures import counted, crew
from conoid.cases.load import material, parse_case
from conoid.cases.model.run import MOST_THREADS
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Outcome
from conoid.cases.output import fields
from conoid.cases.reading.similar import allowed
from conoid.cases.run import ExitCode

from ..drawing.fields import FIELDS
from ..drawing.picture import Drawn
from ..errors import UsageError
from ..live import Live, exit_code
from ..local.own_server import GRACE, LocalServer
from ..remote.run_info import RunInfo
from ..remote.submission import data_of, folder_of
from ..result import Result
from ..run import Run
from ..view import view
from ..watch import explained, show, tell
from . import progress, tables
from .console import PlainConsole, echo_json, one_line
from .options import complain

_LAST_WORDS = 30.0
"""Wall time in s within which the server must report the end of a run after the last message of the run."""


def run_once(
    case: str,
    overrides: list[str],
    runs: Path,
    picture: Path | None = None,
    field: str | None = None,
    *,
    plain: bool = False,
    check: bool = False,
    as_json: bool = False,
) -> int:
    """Runs a case with a server of its own and returns the exit code. A case without ``run.threads`` uses all cores
    of this machine. Ctrl-C and SIGTERM cancel the run, wait for its end and stop the server. Raises CaseError,
    ClientError.
    """
    if field is not None and field not in FIELDS:
        raise UsageError(f"field = {field!r}: {allowed(field, FIELDS)}")
    data = data_of(case, overrides)
    checked = parse_case(data)
    if "threads" not in checked.run.model_fields_set:
        data["run"]["threads"] = all_cores(checked.run.ranks)
        checked = parse_case(data)
    if field in (lacking := fields.lacking(checked)):
        there = [name for name in FIELDS if name not in lacking]
        raise UsageError(f"field = {field!r}: no frame of {checked.name} has it; {allowed(field, there)}")
    out = PlainConsole(quiet=as_json)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    _warn_of_cores(checked)
    server = LocalServer(runs, checked.run.cores)
    with ExitStack() as up:
        at = ["the server is starting"]
        with progress.broken(out.print, lambda: at[-1]):
            up.enter_context(server)
            at.append("submitting the case")
            server.session.outbox.say = at.append
            run = server.session.submit(data, folder=folder_of(case))
        info, printed = _follow(run, checked, out, plain)
    result = Result.open(server.runs / run.id)
    drawn = None
    if info.outcome is not None:
        _report(result, info.outcome, printed, out)
        if picture is not None and result.frames:
            with progress.broken(out.print, lambda: f"drawing {picture}"):
                drawn = view(result, field or _telling_field(checked), picture)
            out.print(f"picture    {drawn.out}", soft_wrap=True)
    if as_json:
        echo_json(_document(run.id, result, info, drawn))
    return _code(info, check)


def all_cores(ranks: int) -> int:
    """Returns the number of threads for each of ``ranks`` ranks so that a run uses all cores of this machine."""
    return min(max(1, usable_cores() // ranks), MOST_THREADS)


def _warn_of_cores(case: Case) -> None:
    """Prints a warning if a run has more threads than this machine has cores, because such a run is slower."""
    run, there = case.run, usable_cores()
    if run.cores > there:
        wanted = f"{crew(run.ranks, run.threads)} want {counted(run.cores, 'core')}"
        complain(
            f"warning: {wanted}, and there {'is' if there == 1 else 'are'} {there}: threads share cores and run slower"
        )


def _follow(run: Run, case: Case, out: Console, plain: bool) -> tuple[RunInfo, set[str]]:
    """Shows the progress of a run until the run ends. The first Ctrl-C cancels the run; a second Ctrl-C has no
    effect. Also returns the log texts that were printed as lines: a panel shows only the last lines of the log.
    """
    known, printed = Live(run.id, title=case.title or case.name), set[str]()
    try:
        link = run.link()
        known.link = link.name
        messages = run.messages(link=link)
        with explained(run, known):
            if out.is_terminal and not plain and not out.quiet:
                show(messages, known, out)
            else:
                tell(messages, known, lambda text: out.print(one_line(text), soft_wrap=True))
                printed = {entry.text for entry in known.log}
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        out.print("cancelling: the run stops at its next step")
        run.cancel()
        return run.wait(GRACE + _LAST_WORDS), printed
    return run.wait(_LAST_WORDS), printed


def _report(result: Result, outcome: Outcome, printed: set[str], out: Console) -> None:
    """Prints the outcome of a run. ``printed``: warnings that have already been printed."""
    out.print()
    for part in tables.end_tables(outcome, printed):
        out.print(part)
    out.print()
    out.print(f"results    {result.folder.path('outcome.json').parent}", soft_wrap=True)


def _telling_field(case: Case) -> str:
    """Returns the field that the picture shows: fragments if a part can break, plastic strain if a part can yield, else
    the von Mises stress.
    """
    if case.fractures:
        return "fragment"
    yields = any(material(case, part.material).strength is not None for part in case.parts)
    return "plastic_strain" if yields else "mises"


def _document(run: str, result: Result, info: RunInfo, drawn: Drawn | None) -> dict[str, Any]:
    folder = result.folder.path("case.resolved.json").parent
    return {"run": run, "folder": str(folder), "state": info.state, "outcome": info.outcome_json, "picture": drawn}


def _code(info: RunInfo, check: bool) -> int:
    missed = info.outcome is not None and not all(each.passed for each in info.outcome.reference)
    if check and missed:
        return ExitCode.CRASHED
    return exit_code(info.state, info.cause)
