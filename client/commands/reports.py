"""Commands that print or draw results of a run, and the command that compares two runs."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.figures import counted, percent, si
from conoid.cases.model.schema import Balance

from ..drawing.fields import require_field
from ..errors import ViewError
from ..reports import compare as comparing
from ..reports import report as reporting
from ..studies import replay
from . import tables
from .comparison_tables import comparison_tables
from .console import echo, echo_json
from .options import Json, SourceArgument, Token, Url, aloud, named, opened, show

figures = typer.Typer(no_args_is_help=True, help="Draw charts of a run.")


OutArgument = Annotated[Path, typer.Argument(metavar="OUT.png", help="PNG, SVG or PDF file to write.")]


@contextmanager
def drawing() -> Iterator[None]:
    """Context for imports of modules that need matplotlib. Raises ViewError if matplotlib is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("conoid"):
            raise
        raise ViewError(f"charts need the extra 'view' of conoid: {error}") from None


@figures.command(name="energy")
def energy_figure(source: SourceArgument, out: OutArgument, url: Url = None, token: Token = None) -> None:
    """Draw the energy balance over time, with and without the kinetic energy, the residual, and the energy of each
    part.
    """
    with drawing():
        from ..reports import curves
    with opened(source, url, token) as result, aloud(f"drawing {out}"):
        echo(curves.save(curves.energy(result.history), out))


@figures.command(name="dt")
def dt_figure(source: SourceArgument, out: OutArgument, url: Url = None, token: Token = None) -> None:
    """Draw the length of the time step over time, and what limits the time step."""
    with drawing():
        from ..reports import curves
    with opened(source, url, token) as result, aloud(f"drawing {out}"):
        echo(curves.save(curves.steps(result.history), out))


@figures.command(name="fragments")
def fragments_figure(source: SourceArgument, out: OutArgument, url: Url = None, token: Token = None) -> None:
    """Draw the number of fragments over time, and the distribution of fragment masses at the end."""
    with drawing():
        from ..reports import curves
    with opened(source, url, token) as result, aloud(f"drawing {out}"):
        tables_of = [result.fragments_of(index) for index in result.fragment_tables]
        echo(curves.save(curves.fragments(tables_of), out))


@figures.command(name="history")
def history_figure(
    source: SourceArgument,
    out: OutArgument,
    column: Annotated[
        list[str] | None,
        typer.Option("--column", help="A column of history.csv; may be repeated; default: the probes."),
    ] = None,
    url: Url = None,
    token: Token = None,
) -> None:
    """Draw columns of history.csv over time; columns with the same unit share a panel."""
    with drawing():
        from ..reports import curves
    with opened(source, url, token) as result, aloud(f"drawing {out}"):
        echo(curves.save(curves.columns(result.history, column or ()), out))


def report(
    source: SourceArgument,
    out: Annotated[
        Path | None, typer.Option("--out", help="Name of the HTML file; default: the id of the run with .html.")
    ] = None,
    field: Annotated[
        list[str] | None,
        typer.Option("--field", help="A field to draw; may be repeated; default: depends on the case."),
    ] = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw frames.")] = True,
    url: Url = None,
    token: Token = None,
) -> None:
    """Write the report of a run: one HTML file that needs no server and no network."""
    with opened(source, url, token) as result:
        for each in field or ():
            require_field(each)
        target = out or Path(f"{result.folder.name}.html")
        with aloud("reading the run") as at:
            written = reporting.write(result, target, field if pictures else (), at)
        echo(written)


def compare(
    a: SourceArgument,
    b: Annotated[str, typer.Argument(metavar="OTHER", callback=named, help="Another run, likewise.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="File for a chart with histories and fragment masses of both runs.")
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            "--column", help="A column of history.csv to draw; may be repeated; default: energies and probes."
        ),
    ] = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Print how two runs differ (keys, final values, fragments), or draw their histories in one chart."""
    with opened(a, url, token) as first, opened(b, url, token) as second, aloud("comparing the runs"):
        found = comparing.compare(first, second)
        if out is not None:
            with drawing():
                from ..reports import curves
            curves.save(curves.comparison(comparing.material(first, second, column or ())), out)
    if as_json:
        echo_json(found)
        return
    for each in comparison_tables(found):
        show(each)
    if out is not None:
        echo(out)


@figures.command(name="balance")
def balance_figure(source: SourceArgument, out: OutArgument, url: Url = None, token: Token = None) -> None:
    """Draw the number of surface nodes of each rank with the changes of the load balance, and the CPU time by phase."""
    with drawing():
        from ..reports import charts
    with opened(source, url, token) as result, aloud(f"drawing {out}"):
        name = str(result.case["name"])
        charts.balance(charts.course(result.messages), f"{name}, {result.folder.name}", name, out)
    echo(out)


def replay_balance(
    source: SourceArgument,
    policy: Annotated[
        str | None,
        typer.Option("--policy", help="measured, outside, every, every:N or never; default: the policy of the run."),
    ] = None,
    alpha: Annotated[float | None, typer.Option("--alpha", help="Parameter alpha of the policy 'outside'.")] = None,
    ranks: Annotated[
        int | None, typer.Option("--ranks", min=1, help="Number of ranks; default: as in the run.")
    ] = None,
    cost: Annotated[
        float | None,
        typer.Option("--cost", min=0.0, help="Cost of one new decomposition in s; default: as measured in the run."),
    ] = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Print what other policies of load balance would have cost and saved, computed from the measured loads of a
    run.
    """
    with opened(source, url, token) as result, aloud("reading the run"):
        spec = Balance.model_validate(result.case.get("balance", {}))
        record = replay.read(result.messages, replay.named(spec))
        x, y, z = result.case["run"].get("cut_scale", (1.0, 1.0, 1.0))
    other, each = replay.chosen(spec, policy or spec.policy, alpha), record.cost if cost is None else cost
    accounts = replay.compare(record, other, ranks or record.happened.ranks, each, (x, y, z))
    if as_json:
        echo_json({"policies": accounts, "run": record.happened, "cost": each, "heaviest_group": record.heaviest})
        return
    show(tables.balance_table(accounts, record.happened))
    echo(
        f"on {counted(accounts[0].ranks, 'rank')}, the run had {record.happened.ranks}; a new decomposition costs "
        f"{si(each, 's')}; "
        f"{counted(len(record.moments), 'moment')}, {counted(len(record.centres), 'group')}, "
        f"of which the heaviest has {percent(record.heaviest)} of the work"
    )
