"""The command line: ``conoid serve | validate | submit | ls | show | watch | cancel | get | view | run``, and more."""

import os
import sys
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
from typer.core import TyperGroup

from conoid.cases import layout
from conoid.cases.estimate import estimate
from conoid.cases.load import CaseError, parse_case
from conoid.cases.plausible import doubts
from conoid.cases.run import ExitCode, State

from . import benches, reports, shelf, sweeping, tables, viewing
from .errors import ClientError
from .live import Live, exit_code
from .once import run_once
from .options import (
    CaseArgument,
    Json,
    Labels,
    Overrides,
    Token,
    Url,
    complain,
    find,
    labels_of,
    show,
    show_json,
    warn,
    warn_of,
)
from .pictures import FIELDS
from .run import Run, RunInfo
from .session import connect
from .submission import data_of, locate
from .watch import watch


class Guarded(TyperGroup):
    """Turns what can go wrong into one clear line on standard error, and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Runs the command."""
        try:
            return super().invoke(ctx)
        except CaseError as error:
            complain(*(str(problem) for problem in error.problems))
            raise typer.Exit(ExitCode.BAD_INPUT) from None
        except ClientError as error:
            complain(str(error))
            raise typer.Exit(error.exit_code) from None
        except KeyboardInterrupt:
            raise typer.Exit(130) from None


app = typer.Typer(
    cls=Guarded, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Impact simulations: submit them, watch them, look at them.",
)  # fmt: skip
app.add_typer(benches.bench, name="bench")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"conoid {metadata.version('conoid')}")
        raise typer.Exit


@app.callback()
def every(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Impact simulations: submit them, watch them, look at them."""


RunArgument = Annotated[str, typer.Argument(metavar="RUN", help="The id of a run, or 'last'.")]


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True}, add_help_option=False,
    short_help="Start the job server.",
)  # fmt: skip
def serve(ctx: typer.Context) -> None:
    """Start the job server; takes the options of the server (conoid serve --help)."""
    page = Path(__file__).parent / "web"
    web = [] if "token" in ctx.args else ["--web", str(page)]
    command = [sys.executable, "-m", "conoid.server", *web, *ctx.args]
    sys.stdout.flush()
    os.execv(command[0], command)


@app.command(short_help="Check a case and estimate what it needs.")
def validate(case: CaseArgument, overrides: Overrides = None, as_json: Json = False) -> None:
    """Check a case: what is wrong with it, what is odd, what its parts bring along and what it needs.

    No server is asked. Warnings go to standard error and leave the exit code 0.
    """
    data = data_of(case, overrides or ())
    checked = parse_case(data)
    expected = estimate(checked, locate(case).parent)
    odd = doubts(data, checked, expected)
    if as_json:
        show_json({"name": checked.name, "valid": True, "warnings": odd, "estimate": expected})
        return
    warn(odd)
    show(f"{checked.name}: valid{f', {len(odd)} warning' + 's' * (len(odd) > 1) if odd else ''}")
    show(tables.parts_table(checked, expected))
    show("")
    show(tables.estimate_table(expected))


@app.command(short_help="Hand a case to the server.")
def submit(
    case: CaseArgument,
    overrides: Overrides = None,
    key: Annotated[str | None, typer.Option("--key", help="Idempotency key: the same one makes no second run.")] = None,
    label: Labels = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Hand a case to the server; prints the run's id."""
    warn_of(case, overrides or ())
    with connect(url, token) as session:
        run = session.submit(case, overrides or (), key, labels_of(label))
        if as_json:
            show_json(run.status())
        else:
            typer.echo(run.id)


@app.command(name="ls")
def list_runs(
    state: Annotated[list[State] | None, typer.Option("--state", help="Only runs in this state.")] = None,
    limit: Annotated[int, typer.Option("--limit", min=1, help="At most so many.")] = 20,
    label: Labels = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """List runs, newest first."""
    with connect(url, token) as session:
        runs = session.runs([one.value for one in state or ()], limit, labels_of(label))
    if as_json:
        show_json(runs)
    elif runs:
        show(tables.runs_table(runs))
    else:
        typer.echo("no runs")


@app.command(name="show")
def show_run(run: RunArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Show one run: where it is, or how it ended."""
    with connect(url, token) as session:
        info = find(session, run).status()
    if as_json:
        show_json(info)
        return
    show(tables.run_table(info))
    if info.outcome is not None:
        show("")
        show(tables.outcome_table(info.outcome))
        if info.outcome.reference:
            show("")
            show(tables.checks_table(info.outcome.reference))


@app.command(name="watch", short_help="Follow a run until it ends.")
def watch_run(
    run: RunArgument,
    plain: Annotated[bool, typer.Option("--plain", help="Lines instead of the panel.")] = False,
    url: Url = None,
    token: Token = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print every message as one line of JSON.")] = False,
) -> None:
    """Follow a run until it ends: 0 succeeded, 1 failed, 2 bad input, 4 cancelled. Ctrl-C leaves it running."""
    with connect(url, token) as session:
        found = find(session, run)
        if as_json:
            raise typer.Exit(_print_messages(found))
        try:
            known = watch(found, False if plain else None)
        except KeyboardInterrupt:
            complain(f"the run goes on; conoid watch {found.id} shows it again")
            raise
    if known.message or known.cause:
        complain(f"{known.run} {known.state.value}: {known.message or known.cause}")
    raise typer.Exit(exit_code(known.state, known.cause))


def _print_messages(run: Run) -> int:
    known = Live(run.id)
    for message in run.messages():
        known.take(message)
        typer.echo(msgspec.json.encode(message).decode())
        sys.stdout.flush()
    return exit_code(known.state, known.cause)


def _tell(info: RunInfo, text: str, as_json: bool) -> None:
    if as_json:
        show_json(info)
    else:
        typer.echo(text)


@app.command()
def cancel(run: RunArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Stop a run at its next step."""
    with connect(url, token) as session:
        info = find(session, run).cancel()
    _tell(info, f"{info.id} {info.state.value}", as_json)


@app.command()
def checkpoint(run: RunArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Ask a run for a checkpoint, from which it can go on if it is lost."""
    with connect(url, token) as session:
        info = find(session, run).checkpoint()
    _tell(info, f"{info.id} asked for a checkpoint", as_json)


@app.command()
def snapshot(run: RunArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Ask a run for a snapshot of its fragments; watch tells when it is there."""
    with connect(url, token) as session:
        info = find(session, run).take_snapshot()
    _tell(info, f"{info.id} asked for a snapshot", as_json)


@app.command()
def get(
    run: RunArgument,
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FILE]...", help="Files to fetch; all when none, but for checkpoints."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to copy into; the run's id when not given.")] = None,
    url: Url = None,
    token: Token = None,
    as_json: Annotated[bool, typer.Option("--json", help="List the run's files as JSON; copies nothing.")] = False,
) -> None:
    """Copy a run's files here."""
    with connect(url, token) as session:
        found = find(session, run)
        if as_json:
            show_json(found.files())
            return
        target = out or Path(found.id)
        every = (file.path for file in found.files())
        for name in names or [path for path in every if not path.startswith(f"{layout.CHECKPOINTS}/")]:
            typer.echo(str(found.download(target, name)))


app.command(name="view", short_help="Draw frames, off screen.")(viewing.view_frames)
app.command(name="replay-balance", short_help="The loads of a run under another balance policy.")(
    reports.replay_balance
)
app.command(short_help="Write a run as one HTML file.")(reports.report)
app.command(short_help="Tell in what two runs differ.")(reports.compare)
app.add_typer(reports.figures, name="figures")
app.command(short_help="Run a case at many points.")(sweeping.sweep)
app.command(name="sweep-table", short_help="Print a sweep as CSV.")(sweeping.sweep_table)
app.command(name="sweep-cancel", short_help="Cancel the runs of a sweep.")(sweeping.sweep_cancel)


@app.command(name="run", short_help="Do it all on this machine: run, watch, check, draw.")
def run_case(
    case: CaseArgument,
    ranks: Annotated[
        int | None, typer.Option("--ranks", min=1, help="MPI ranks; the case's own number if not given.")
    ] = None,
    overrides: Overrides = None,
    out: Annotated[Path, typer.Option("--out", help="Folder of the runs.")] = Path("runs/local"),
    picture: Annotated[Path | None, typer.Option("--view", help="Draw the last frame to this PNG.")] = None,
    field: Annotated[str | None, typer.Option("--field", help=f"What to colour by: {', '.join(FIELDS)}.")] = None,
    plain: Annotated[bool, typer.Option("--plain", help="Lines instead of the panel.")] = False,
    check: Annotated[bool, typer.Option("--check", help="End with 1 when a reference number is missed.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the outcome as JSON and nothing else.")] = False,
) -> None:
    """Do it all here: start a server, submit, watch, check, draw, stop the server. Ctrl-C cancels the run."""
    chosen = [*(overrides or ()), *([f"run.ranks={ranks}"] if ranks is not None else [])]
    warn_of(case, chosen)
    raise typer.Exit(run_once(case, chosen, out, picture, field, plain=plain, check=check, as_json=as_json))


app.add_typer(shelf.cases, name="cases")
app.command(short_help="Print the keys of a case, for editors or people.")(shelf.schema)
app.command(short_help="List the material library, or one material.")(shelf.materials)


def main() -> None:
    """The entry point ``conoid``."""
    app()


if __name__ == "__main__":
    main()
