"""The commands ``conoid sweep``, ``sweep-table``, ``sweep-plot`` and ``sweep-cancel``."""

import hashlib
import json
import sys
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer

from conoid.cases.estimates.cores import usable_cores
from conoid.cases.figures import counted
from conoid.cases.load import CaseError, apply_overrides, parse_case
from conoid.cases.output.points import KEY, to_csv
from conoid.cases.run import State

from ..errors import ClientError, ServiceError, UsageError
from ..local.atomic import save_text
from ..local.own_server import LocalServer
from ..remote.session import Session, connect
from ..remote.submission import data_of, folder_of, locate
from ..reports.compare import changes
from ..sweeps.sweep import Point, Sweep, SweepInfo, SweepPoint, points_in, points_of, text_rows
from ..sweeps.sweep_files import columns_of, file_named
from . import adapting, points_table
from .console import echo, echo_json
from .options import CaseArgument, Json, Ranks, Threads, Token, Url, aloud, complain, on_cores, show, sweep_named
from .reports import drawing
from .sweep_progress import ended, how, standing

SweepArgument = Annotated[
    str,
    typer.Argument(metavar="SWEEP", callback=sweep_named, help="Id of a sweep (or its beginning), 'last', or a file."),
]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=A,B,C",
        help="Values of a key, or one value for all points; KEY=LOW:HIGH with --adaptive; may be repeated.",
    ),
]  # fmt: skip
Adaptive = Annotated[
    str | None,
    typer.Option(
        "--adaptive",
        metavar="'RESULT = VALUE'",
        help="Search for the point at which a result of the table crosses a value.",
    ),
]
Tolerance = Annotated[
    str | None,
    typer.Option("--tolerance", help="With --adaptive: final width of the bracket; default: 1 % of its larger end."),
]
Listed = Annotated[
    Path | None, typer.Option("--list", metavar="FILE", help="CSV file with the points; its first line has the keys.")
]
Most = Annotated[
    int | None, typer.Option("--most", min=2, help="With --adaptive: largest number of runs; default: 40.")
]
Wait = Annotated[bool, typer.Option("--wait", help="Wait until all runs have ended; exit code 1 if a run failed.")]
Answer = Annotated[
    Path | None, typer.Option("--out", help="File for the table (CSV); with --adaptive, file for the result (JSON).")
]


@dataclass(frozen=True)
class Place:
    """Place where runs are computed: a named server, or a folder of this machine with a server of its own."""

    local: bool
    runs: Path
    url: str | None
    token: str | None

    @contextmanager
    def session(self, data: Mapping[str, Any]) -> Iterator[Session]:
        """Yields a session. A server of its own has slots for all cores, and at least the slots of one run."""
        if not self.local:
            with connect(self.url, self.token) as session:
                yield session
            return
        cores = usable_cores()
        with suppress(CaseError):  # Errors of the case are reported when the points are made.
            cores = max(cores, parse_case(data).run.cores)
        with LocalServer(self.runs, cores) as server:
            yield server.session


def sweep(
    case: CaseArgument,
    sets: Sets = None,
    grid: Annotated[bool, typer.Option("--grid", help="Run all combinations of the values.")] = False,
    listed: Listed = None,
    adaptive: Adaptive = None,
    tolerance: Tolerance = None,
    most: Most = None,
    ranks: Ranks = None,
    threads: Threads = None,
    at_once: Annotated[int | None, typer.Option("--at-once", min=1, help="Largest number of runs at a time.")] = None,
    wait: Wait = False,
    new: Annotated[bool, typer.Option("--new", help="Start a new sweep, even if an equal sweep exists.")] = False,
    local: Annotated[bool, typer.Option("--local", help="Run on this machine, without a server.")] = False,
    runs: Annotated[Path, typer.Option("--runs", help="With --local: folder of the runs.")] = Path("runs/local"),
    out: Answer = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Run a case at many points, or search for the point at which a result crosses a value.

    If the same command is repeated, an interrupted sweep continues: points whose runs have succeeded are not
    computed again.
    """
    cores, place = on_cores(ranks, threads), Place(local, runs, url, token)
    if adaptive is not None:
        if grid or listed is not None:
            raise UsageError("--adaptive needs --set KEY=LOW:HIGH and allows neither --grid nor --list")
        with place.session(data_of(case, cores)) as session:
            found = adapting.adaptive(
                session, case, adaptive, sets or (), cores, tolerance, at_once, most, out, new=new, as_json=as_json
            )
        adapting.finish(found)
        return
    if tolerance is not None or most is not None:
        raise UsageError("--tolerance and --most are allowed only with --adaptive 'RESULT = VALUE'")
    if (listed is None) == (not sets):
        raise UsageError("give the points with --set KEY=A,B,C, or with --list FILE")
    points = points_in(listed) if listed is not None else points_of(sets or (), grid=grid)
    data = data_of(case, cores)
    key = str(uuid.uuid4()) if new else _same(case, points, cores, at_once)
    with place.session(data) as session:
        made = _handed_in(session, case, data, points, at_once, key)
        info = _waited(made) if wait or local or out is not None else made.status()
        _end(made, info, out, as_json=as_json)


def _same(case: str, points: Sequence[Point], cores: Sequence[str], at_once: int | None) -> str:
    """Returns the idempotency key of the sweep; equal arguments give the same key."""
    identity = json.dumps([locate(case).stem, points, list(cores), at_once], default=str)
    return f"sweep-{hashlib.sha256(identity.encode()).hexdigest()[:40]}"


def _handed_in(
    session: Session, case: str, data: Mapping[str, Any], points: Sequence[Point], at_once: int | None, key: str
) -> Sweep:
    try:
        with aloud(f"handing {counted(len(points), 'point')} in") as session.outbox.say:
            return session.sweep(data, points, at_once=at_once, folder=folder_of(case), key=key, again=True)
    except ServiceError as error:
        if error.problem.get("code") != "key_reused":
            raise
        keys = _changed(session, str(error.problem.get("detail", "")), data, points[0], folder_of(case))
        hint = f"the case has changed since the start of this sweep{keys}; --new starts a new sweep"
        raise UsageError(f"{case}: {hint}") from None
    except KeyboardInterrupt:
        complain("the server may already have the points; if all are there, conoid sweep-cancel last stops them")
        raise


def _changed(session: Session, detail: str, data: Mapping[str, Any], point: Point, folder: Path) -> str:
    """Returns the keys in which the case differs from the case of an earlier sweep; empty if unknown. The id of the
    earlier sweep is at the end of ``detail``.
    """
    try:
        (_, sweep), first = detail.rsplit(": ", 1), session.outbox.ready(apply_overrides(data, point), folder)
        run = session.find_sweep(sweep).status().points[0].run.id
        before = msgspec.json.decode(session.fetch(f"/v1/runs/{run}/files/case.json"))
    except (ClientError, CaseError, ValueError, IndexError):
        return ""
    found = changes(before, first)
    return f": {found}" if found else ""


def _waited(made: Sweep) -> SweepInfo:
    try:
        with aloud(f"sweep {made.id}: waiting for its runs") as name:

            def say(info: SweepInfo, point: SweepPoint) -> None:
                complain(f"{ended(info)} of {info.total}: {how(point)}")

            return made.wait(say=say, at=lambda info: name(standing(info)))
    except KeyboardInterrupt:
        complain(
            f"repeat the command to continue; conoid sweep-table {made.id} shows the runs, conoid sweep-cancel "
            f"{made.id} "
            "stops them"
        )
        raise


def _end(made: Sweep, info: SweepInfo, out: Path | None, *, as_json: bool) -> None:
    if out is not None:
        save_text(out, made.csv())
    if as_json:
        echo_json(info)
    else:
        echo(info.id)
    failed = [point for point in info.points if point.run.state.final and point.run.state is not State.SUCCEEDED]
    if failed and info.over:
        complain(failures(failed, info.total))
        raise typer.Exit(1)


def failures(failed: list[SweepPoint], total: int) -> str:
    """Returns a text with the number of runs without success, and the first of these runs."""
    values, run = failed[0].values, failed[0].run
    point = ", ".join(f"{key} = {value}" for key, value in values.items())
    why = run.message or run.cause
    how = f"{run.state.value}: {why}" if why else run.state.value
    return f"{len(failed)} of {total} runs have not succeeded; {run.id} ({point}) {how}"


def sweep_table(
    sweep: SweepArgument,
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", help="Column of the table; may be repeated; default: the columns that differ."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="CSV file to write; default: standard output.")] = None,
    url: Url = None,
    token: Token = None,
) -> None:
    """Print a sweep: one line for each point with its values, state and results.

    In a terminal the command prints a table with the results that differ, or with the named columns. In a pipe or a
    file (--out) it writes CSV with all columns, or with the keys, the state and the named columns.
    """
    if (path := file_named(sweep)) is not None:
        made = columns_of(path)
        text, keys = to_csv(made), [column.name for column in made if column.kind == KEY]
    else:
        with connect(url, token) as session, aloud("reading the sweep"):
            found = session.find_sweep(sweep)
            text, keys = found.csv(), found.keys()
    if columns:
        text = points_table.narrowed(text, keys, columns)
    if out is None and sys.stdout.isatty():
        show(points_table.table_of(text_rows(text), keys, whole=bool(columns)))
    elif out is None:
        echo(text, nl=False)
    else:
        save_text(out, text)
        echo(str(out))


def sweep_plot(
    sweep: SweepArgument,
    out: Annotated[
        Path, typer.Option("--out", help="Picture file to write; the ending of its name selects the format.")
    ] = Path("sweep.png"),
    columns: Annotated[
        list[str] | None,
        typer.Option("--column", help="Column of the table; may be repeated; default: the columns that differ."),
    ] = None,
    x: Annotated[
        str | None, typer.Option("--x", metavar="KEY", help="Key on the x axis; default: the first key that varies.")
    ] = None,
    url: Url = None,
    token: Token = None,
) -> None:
    """Draw the results of a sweep over the varied key: a panel for each result, a curve for each value of the other
    keys.
    """
    with aloud(f"drawing {out}"):
        if (path := file_named(sweep)) is not None:
            made = columns_of(path)
            keys = [column.name for column in made if column.kind == KEY]
            with drawing():
                from ..reports.curves import save
                from ..sweeps.sweep_plot import figure
            drawn = save(figure(text_rows(to_csv(made)), keys, x, columns or ()), out)
        else:
            with connect(url, token) as session:
                drawn = session.find_sweep(sweep).plot(out, columns or (), x)
    echo(str(drawn))


def sweep_cancel(sweep: SweepArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Cancel all open runs of a sweep."""
    with connect(url, token) as session:
        info: SweepInfo = session.find_sweep(sweep).cancel()
    if as_json:
        echo_json(info)
    else:
        echo(f"{info.id} {'has ended' if info.over else 'cancelling'}")
