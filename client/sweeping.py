"""``conoid sweep``: hand in, look at, cancel, the table and the plot."""

from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.figures import counted
from conoid.cases.run import State

from .console import echo, echo_json
from .errors import UsageError
from .options import CaseArgument, Json, Ranks, Threads, Token, Url, aloud, complain, on_cores, sweep_named
from .saving import save_text
from .session import connect
from .submission import data_of, folder_of
from .sweep import SweepInfo, SweepPoint, points_in, points_of

SweepArgument = Annotated[
    str, typer.Argument(metavar="SWEEP", callback=sweep_named, help="Id of a sweep or its beginning, or 'last'.")
]
Sets = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=A,B,C", help="Values of a key; may be given again.")
]


def sweep(
    case: CaseArgument,
    sets: Sets = None,
    grid: Annotated[bool, typer.Option("--grid", help="Each value of a key with each of the others.")] = False,
    listed: Annotated[
        Path | None, typer.Option("--list", metavar="FILE", help="Points from a CSV file; its first line has the keys.")
    ] = None,
    ranks: Ranks = None,
    threads: Threads = None,
    at_once: Annotated[int | None, typer.Option("--at-once", min=1, help="Runs of it that run at a time.")] = None,
    wait: Annotated[bool, typer.Option("--wait", help="Return when all runs have ended; 1 when one failed.")] = False,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Run a case at many points; prints the id of the sweep. sweep-table and sweep-plot show what came out."""
    if (listed is None) == (not sets):
        raise UsageError("give the points with --set KEY=A,B,C, or with --list FILE")
    points = points_in(listed) if listed is not None else points_of(sets or (), grid=grid)
    with connect(url, token) as session:
        try:
            with aloud(f"handing {counted(len(points), 'point')} in") as session.outbox.say:
                data = data_of(case, on_cores(ranks, threads))
                made = session.sweep(data, points, at_once=at_once, folder=folder_of(case))
        except KeyboardInterrupt:
            complain(
                "the server may have the points already; conoid sweep-cancel last stops them once it has taken all in"
            )
            raise
        try:
            with aloud(f"sweep {made.id}: waiting for its runs"):
                info = made.wait() if wait else made.status()
        except KeyboardInterrupt:
            complain(
                f"the runs go on; conoid sweep-table {made.id} shows them, conoid sweep-cancel {made.id} stops them"
            )
            raise
    if as_json:
        echo_json(info)
    else:
        echo(info.id)
    failed = [point for point in info.points if wait and point.run.state is not State.SUCCEEDED]
    if failed:
        complain(told(failed, info.total))
        raise typer.Exit(1)


def told(failed: list[SweepPoint], total: int) -> str:
    """How many runs have not succeeded, and the first of them."""
    values, run = failed[0].values, failed[0].run
    point = ", ".join(f"{key} = {value}" for key, value in values.items())
    why = run.message or run.cause
    how = f"{run.state.value}: {why}" if why else run.state.value
    return f"{len(failed)} of {total} runs have not succeeded; {run.id} ({point}) {how}"


def sweep_table(
    sweep: SweepArgument,
    out: Annotated[Path | None, typer.Option("--out", help="CSV file to write; standard output if not given.")] = None,
    url: Url = None,
    token: Token = None,
) -> None:
    """Print a sweep as CSV: a line a point with its values, the state of its run and its results."""
    with connect(url, token) as session, aloud("reading the sweep"):
        text = session.find_sweep(sweep).csv()
    if out is None:
        echo(text, nl=False)
    else:
        save_text(out, text)
        echo(str(out))


def sweep_plot(
    sweep: SweepArgument,
    out: Annotated[Path, typer.Option("--out", help="PNG file to write, or what its name ends in.")] = Path(
        "sweep.png"
    ),
    columns: Annotated[
        list[str] | None, typer.Option("--column", help="Of the table; may be given again. If none: what differs.")
    ] = None,
    x: Annotated[str | None, typer.Option("--x", metavar="KEY", help="On the axis; the first that varies.")] = None,
    url: Url = None,
    token: Token = None,
) -> None:
    """Draw the results of a sweep over what was changed: a panel a result, a curve a value of other keys."""
    with connect(url, token) as session:
        with aloud(f"drawing {out}"):
            drawn = session.find_sweep(sweep).plot(out, columns or (), x)
        echo(str(drawn))


def sweep_cancel(sweep: SweepArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Cancel every run of a sweep that has not ended."""
    with connect(url, token) as session:
        info: SweepInfo = session.find_sweep(sweep).cancel()
    if as_json:
        echo_json(info)
    else:
        echo(f"{info.id} {'has ended' if info.over else 'cancelling'}")
