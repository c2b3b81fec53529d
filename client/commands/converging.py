"""The command ``conoid converge``: it runs a case on several meshes and reports the error and the cost of each mesh."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.figures import counted, duration, number
from conoid.cases.load import parse_case
from conoid.cases.model.schema import Case
from conoid.cases.reading.problems import shown
from conoid.cases.reading.similar import allowed
from conoid.cases.run import ExitCode

from ..errors import UsageError
from ..local.atomic import save_text
from ..local.own_server import LocalServer
from ..remote.session import Session, connect
from ..remote.submission import data_of, folder_of
from ..studies import converged
from ..studies.converged import Book
from ..studies.convergence import Done, run_all, series
from ..studies.quantities import names
from ..studies.scaling import CORES
from ..studies.variants import FORMS, SEEDS, STEPS, Plan, Variant, chaotic, sizes
from .console import echo
from .options import CaseArgument, Overrides, Token, Url, aloud, complain
from .reports import drawing

_ENSEMBLE = 5
"""Number of runs in the ensemble of each point if the case has fracture (chosen value: the standard deviation of five
runs has an uncertainty of about a third)."""


def converge(
    case: CaseArgument,
    overrides: Overrides = None,
    meshes: Annotated[str, typer.Option("--meshes", help="Factors of the element sizes.")] = "2,1.414,1",
    forms: Annotated[str, typer.Option("--forms", help="Pressure forms, as standard,nodal,split.")] = "",
    safeties: Annotated[str, typer.Option("--dt-safety", help="Values of numerics.dt_safety.")] = "",
    ensemble: Annotated[
        int | None, typer.Option("--ensemble", min=1, help="Runs for each point; default: 5 with fracture, else 1.")
    ] = None,
    vary: Annotated[
        str, typer.Option("--vary", help="Difference between runs of an ensemble: steps or seeds.")
    ] = STEPS,
    ranks: Annotated[int, typer.Option("--ranks", min=1, help="Ranks of each run.")] = 1,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Threads of each rank.")] = 1,
    quantity: Annotated[str | None, typer.Option("--quantity", help="Quantity of the advice.")] = None,
    accuracy: Annotated[float, typer.Option("--accuracy", min=1e-6, help="Requested error, in per cent.")] = 1.0,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for converge.md, .json, .png; runs in it are used again.")
    ] = None,
    on_server: Annotated[bool, typer.Option("--server", help="Run on the server instead of this machine.")] = False,
    url: Url = None,
    token: Token = None,
) -> None:
    """Measure error against cost for any case: orders, limits with uncertainty, error over cost, advice.

    Exit code 1 if a run did not succeed.
    """
    data = data_of(case, overrides or ())
    checked = parse_case(data)
    if quantity is not None and not any(quantity in name for name in names(checked)):
        raise UsageError(f"--quantity = {shown(quantity)}: no such quantity; {allowed(quantity, names(checked))}")
    members = ensemble or (_ENSEMBLE if chaotic(checked) else 1)
    plan = Plan(_numbers("--meshes", meshes), _forms(forms), _numbers("--dt-safety", safeties), members,
                _one_of("--vary", vary, (STEPS, SEEDS)), ranks, threads)  # fmt: skip
    done: list[Done] = []
    many = len(plan.points(checked))
    with (
        tempfile.TemporaryDirectory() as passing,
        aloud(f"0 of {many} runs have ended") as name,
        _session(out or Path(passing), ranks * threads, on_server, url, token) as at,
    ):
        for each in run_all(at, data, plan, folder_of(case)):
            done.append(each)
            name(f"{len(done)} of {many} runs have ended")
            complain(f"{len(done)} of {many}: {_result_of(each)}")
    book = _book(checked, overrides or (), plan, accuracy, done)
    _write(book, quantity, out)
    raise typer.Exit(ExitCode.CRASHED if book.failed else ExitCode.SUCCEEDED)


@contextmanager
def _session(out: Path, cores: int, on_server: bool, url: str | None, token: str | None) -> Iterator[Session]:
    """Yields a session on the named server, or on a server of its own with a slot for each core."""
    if on_server or url is not None:
        with connect(url, token) as session:
            yield session
        return
    with LocalServer(out / "runs", max(cores, CORES)) as server:
        yield server.session


def _result_of(each: Done) -> str:
    where = f"{each.point.variant}, sizes x {number(each.point.factor)}"
    cost = f"{counted(each.steps, 'step')}, {duration(each.cpu)} of CPU time"
    return f"{where}: {each.problem or cost}"


def _book(case: Case, changes: Sequence[str], plan: Plan, accuracy: float, done: Sequence[Done]) -> Book:
    first = next((each for each in done if not each.problem), None)
    own = min(value for key, value in sizes(case, 1.0).items() if key.endswith("element_size"))
    variant = Variant(case.numerics.pressure, case.numerics.dt_safety)
    return Book(
        case.name, changes, variant, own, plan.members, plan.vary, accuracy / 100.0, done, series(done),
        first.numbers if first else (),
    )  # fmt: skip


def _write(book: Book, quantity: str | None, out: Path | None) -> None:
    text = converged.to_markdown(book, quantity)
    if out is not None:
        save_text(out / "converge.md", text)
        save_text(out / "converge.json", converged.to_json(book, quantity))
        with drawing():
            from ..reports.curves import save
            from ..studies.pareto import figure
        save(figure(book), out / "converge.png")
    echo(text, nl=False)


def _numbers(option: str, text: str) -> list[float]:
    """Returns the numbers of a text with commas; the numbers are positive and different. Raises ClientError."""
    try:
        values = [float(word) for word in text.split(",")] if text.strip() else []
    except ValueError:
        values = [0.0]
    wrong = not all(0.0 < value < 1e6 for value in values) or len(set(values)) < len(values)
    if wrong or (option == "--meshes" and not values):
        raise UsageError(f"{option} = {shown(text)}: allowed: positive numbers, each once, with commas between them")
    return sorted(values)


def _forms(text: str) -> list[str]:
    return [_one_of("--forms", word.strip(), FORMS) for word in text.split(",")] if text.strip() else []


def _one_of(option: str, word: str, known: Sequence[str]) -> str:
    if word not in known:
        raise UsageError(f"{option} = {shown(word)}: {allowed(word, known)}")
    return word
