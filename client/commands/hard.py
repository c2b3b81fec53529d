"""The command ``conoid hard``: it runs the suite of hard cases, several at a time, and prints a verdict for each
case.
"""

import json
import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from conoid.cases.figures import count, duration, fixed, rough
from conoid.cases.load import apply_overrides, parse_case, read_data
from conoid.cases.model.schema import Case
from conoid.cases.outcome import Outcome
from conoid.cases.reading.similar import allowed
from conoid.cases.run import ExitCode
from conoid.cases.suite import Hard, drift, faults, is_free, suite

from ..columns import Columns
from ..errors import UsageError
from ..local.atomic import save_text
from ..local.own_server import LocalServer
from ..remote.session import Session
from ..run import Run
from ..studies.scaling import CORES
from ..studies.study import table
from .console import echo
from .options import aloud, complain


@dataclass(frozen=True)
class Verdict:
    """Result of a hard case."""

    hard: Hard
    title: str
    outcome: Outcome
    drifted: float | None
    """Drift of the momentum during the run; None for a case with an external force."""
    faults: list[str]


def hard(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Names of cases, or rows such as H14.")
    ] = None,
    ranks: Annotated[
        int, typer.Option("--ranks", min=1, help="Ranks of each run; the answer does not depend on them.")
    ] = 1,
    threads: Annotated[
        int, typer.Option("--threads", min=1, help="Threads of each rank; the answer does not depend on them.")
    ] = 1,
    listed: Annotated[bool, typer.Option("--list", help="List the cases without a run.")] = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for hard.md, hard.json and the runs.")] = None,
) -> None:
    """Run the suite of hard cases; print state, largest energy residual, drift of the momentum and steps of each.

    Exit code 1 if a case fails.
    """
    some = chosen(suite(), names or ())
    if listed:
        rows = [[each.name, " ".join(each.rows), each.case, " ".join(each.changes)] for each in some]
        echo(table(("name", "rows", "case", "changes"), rows))
        return
    with (
        tempfile.TemporaryDirectory() as passing,
        aloud(f"0 of {len(some)} runs have ended") as name,
        LocalServer((out or Path(passing)) / "runs", max(ranks * threads, CORES)) as at,
    ):
        ended = []
        for verdict in run_all(at.session, some, ranks, threads):
            ended.append(verdict)
            name(f"{len(ended)} of {len(some)} runs have ended")
            complain(f"{len(ended)} of {len(some)}: {verdict.hard.name}: {'; '.join(verdict.faults) or 'ended well'}")
    text = to_markdown(ended)
    if out is not None:
        save_text(out / "hard.md", text)
        save_text(out / "hard.json", msgspec.json.format(msgspec.json.encode(ended), indent=1))
    echo(text, nl=False)
    raise typer.Exit(ExitCode.CRASHED if any(verdict.faults for verdict in ended) else ExitCode.SUCCEEDED)


def chosen(known: Sequence[Hard], words: Sequence[str]) -> list[Hard]:
    """Returns the cases with the given names or rows of the catalogue; without arguments, all cases. Raises ClientError
    if a word is unknown.
    """
    for word in words:
        if not any(word == each.name or word in each.rows for each in known):
            names = allowed(word, [each.name for each in known])
            raise UsageError(
                f"hard = {word!r}: allowed: a row of the catalogue such as H14, or the name of a case; {names}"
            )
    return [each for each in known if not words or each.name in words or set(each.rows) & set(words)]


def run_all(session: Session, some: Sequence[Hard], ranks: int, threads: int = 1) -> Iterator[Verdict]:
    """Submits all cases, and yields the verdict on each case after its run. Raises CaseError for an invalid case."""
    quiet = {
        "run.ranks": ranks, "run.threads": threads, "run.frames": 0, "run.snapshots": 0,
        "run.checkpoint_every": "none",
    }  # fmt: skip
    made = [apply_overrides(apply_overrides(read_data(each.path), each.changes), quiet) for each in some]
    cases = [parse_case(data) for data in made]
    runs = [session.submit(json.loads(json.dumps(data, default=str))) for data in made]
    for each, case, run in zip(some, cases, runs, strict=True):
        yield _ended(each, case, run)


def _ended(each: Hard, case: Case, run: Run) -> Verdict:
    info = run.wait()
    outcome = info.outcome or Outcome(state=info.state.value, message=info.message or str(info.cause))
    drifted = drift(case, _momenta(run.result().history)) if is_free(case) and info.outcome is not None else None
    return Verdict(each, case.title, outcome, drifted, faults(each, outcome, drifted))


def _momenta(columns: Columns) -> list[tuple[float, float, float]]:
    x, y, z = (columns.numbers(f"momentum_{axis}") for axis in "xyz")
    return list(zip(x, y, z, strict=True))


def to_markdown(ended: Sequence[Verdict]) -> str:
    """Returns a Markdown table with one line for each case, and then the failures."""
    head = ("case", "rows", "state", "worst residual", "momentum drift", "steps", "tets", "CPU s", "references")
    rows = [
        [
            verdict.hard.name, " ".join(verdict.hard.rows), verdict.outcome.state,
            rough(verdict.outcome.worst_residual), rough(verdict.drifted),
            count(verdict.outcome.steps), count(verdict.outcome.elements), fixed(verdict.outcome.cpu, 1),
            _references(verdict.outcome),
        ]
        for verdict in ended
    ]  # fmt: skip
    bad = [f"- **{verdict.hard.name}**: {'; '.join(verdict.faults)}" for verdict in ended if verdict.faults]
    spent = sum(v.outcome.cpu for v in ended if not math.isnan(v.outcome.cpu))
    summary = f"{len(ended) - len(bad)} of {len(ended)} cases passed, in {duration(spent)} of CPU time."
    return "\n\n".join(filter(None, [table(head, rows), summary, "\n".join(bad)])) + "\n"


def _references(outcome: Outcome) -> str:
    met = sum(check.passed for check in outcome.reference)
    return f"{met} of {len(outcome.reference)}" if outcome.reference else "-"
