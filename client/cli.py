"""The command line ``conoid`` with its commands ``serve``, ``validate``, ``submit``, ``runs``, ``show``, ``watch``,
``get``, ``view``, ``run`` and others.
"""

import os
import sys
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from conoid.cases.figures import counted
from conoid.cases.load import CaseError
from conoid.cases.run import ExitCode
from conoid.cases.shapes.loaded import loads

from .commands import benches, converging, hard, listing, reports, server_runs, shipped, sweeping, validated, viewing
from .commands.batch import batch_run
from .commands.console import echo, echo_json, one_line, prepare
from .commands.helping import Grouped
from .commands.options import (
    FILE_OPTIONS,
    CaseArgument,
    Json,
    Overrides,
    Ranks,
    Threads,
    aloud,
    complain,
    on_cores,
    show,
    warn,
)
from .commands.run_command import run_once
from .decks.command import import_deck
from .drawing.fields import FIELDS
from .errors import ClientError
from .examination import examine
from .remote.submission import data_of, locate

_Mistake = cast(type[typer.BadParameter], typer.BadParameter.__base__)
"""Error of typer for an unknown command, option or value; the class has no public name."""


class Guarded(Grouped):
    """Group of commands that prints an error as one clear line on standard error and returns the exit code."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Parses the arguments and runs the command. A full disk is reported in one line, for a help text as well."""
        if sys.stdout is None:
            complain("standard output is closed; redirect it to a file or to /dev/null")
            sys.exit(1)
        try:
            return super().main(*arguments, **options)
        except OSError as error:
            complain(f"{error.filename}: {error.strerror}" if error.filename else str(error.strerror or error))
            sys.exit(1)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the arguments. Refuses an empty file name, as from an unset variable, because it would mean the
        working folder."""
        for option, value in pairwise([*args, "-"]):
            if option.removesuffix("=") in FILE_OPTIONS and (not value or option.endswith("=")):
                complain(f"{option.removesuffix('=')} is empty: write the name of a file or a folder")
                raise typer.Exit(ExitCode.BAD_INPUT)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Runs the command, and prints an error as one line."""
        try:
            return super().invoke(ctx)
        except CaseError as error:
            complain(*(str(problem) for problem in error.problems))
            raise typer.Exit(ExitCode.BAD_INPUT) from None
        except ClientError as error:
            complain(str(error))
            raise typer.Exit(error.exit_code) from None
        except _Mistake as error:
            error.message = one_line(error.message)
            raise
        except KeyboardInterrupt:
            raise typer.Exit(130) from None


app = typer.Typer(
    cls=Guarded, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None,
    help="Submit, watch and view impact simulations.",
)  # fmt: skip
app.add_typer(benches.bench, name="bench")


def _version(asked: bool) -> None:
    if asked:
        echo(f"conoid {metadata.version('conoid')}")
        raise typer.Exit


@app.callback()
def every(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Submit, watch and view impact simulations."""


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True}, add_help_option=False,
    short_help="Start the job server.",
)  # fmt: skip
def serve(ctx: typer.Context) -> None:
    """Start the job server; the options are those of the server (conoid serve --help)."""
    page = Path(__file__).parent / "web"
    web = [] if "token" in ctx.args else ["--web", str(page)]
    command = [sys.executable, "-P", "-m", "conoid.server", *web, *ctx.args]
    sys.stdout.flush()
    os.execv(command[0], command)


@app.command(short_help="Check a case and estimate its needs.")
def validate(
    case: CaseArgument, overrides: Overrides = None, ranks: Ranks = None, threads: Threads = None, as_json: Json = False
) -> None:
    """Check a case: errors, warnings, content of its parts, cost.

    The command reads mesh files and needs no server. Warnings go to standard error and leave the exit code 0.
    """
    with aloud("reading mesh files"):
        found = examine(data_of(case, [*(overrides or ()), *on_cores(ranks, threads)]), locate(case).parent)
    checked, expected, odd = found.case, found.expected, found.odd
    if as_json:
        answer = {
            "estimate": expected,
            "loads": loads(checked, found.survey.loads),
            "files": found.survey.parts,
            "touching": found.touching,
        }
        echo_json({"name": checked.name, "valid": True, "warnings": odd, **answer})
        return
    warn(odd)
    warned = f", {counted(len(odd), 'warning')}" if odd else ""
    show(f"{checked.name}: valid{warned}")
    show(validated.parts_table(checked, expected))
    if found.survey.parts:
        show("")
        show(validated.files_table(checked, found.survey))
    if found.touching:
        show("")
        show(validated.touching_table(checked, found.touching))
    if acted_on := loads(checked, found.survey.loads):
        show("")
        show(validated.loads_table(checked, acted_on))
    show("")
    show(validated.estimate_table(checked, expected))


app.command(short_help="Submit a case to the server.")(server_runs.submit)
app.command(name="runs", short_help="List runs, newest first.")(listing.runs)
app.command(name="ls", hidden=True)(listing.runs)
app.command(name="show", short_help="Show the progress or the outcome of one run.")(server_runs.show_run)
app.command(name="watch", short_help="Follow a run until it ends.")(server_runs.watch_run)
app.command(short_help="Stop a run at its next step.")(server_runs.cancel)
app.command(short_help="Request a checkpoint of a run.")(server_runs.checkpoint)
app.command(short_help="Request a snapshot of the fragments of a run.")(server_runs.snapshot)
app.command(short_help="Continue a run from its newest checkpoint.")(server_runs.restart)
app.command(short_help="Copy the files of a run to this machine.")(server_runs.get)
app.command(name="batch", short_help="Submit a case to Slurm, without a server.")(batch_run)
app.command(name="view", short_help="Draw frames as a picture or a film.")(viewing.view_frames)
app.command(name="replay-balance", short_help="Show the loads of a run under another balance policy.")(
    reports.replay_balance
)
app.command(short_help="Write a run as one HTML file.")(reports.report)
app.command(short_help="Print the differences between two runs.")(reports.compare)
app.add_typer(reports.figures, name="figures")
app.command(short_help="Compare meshes: order, limit, error over cost.")(converging.converge)
app.command(short_help="Run the suite of hard cases.")(hard.hard)
app.command(short_help="Run a case at many points, or find a threshold.")(sweeping.sweep)
app.command(name="sweep-table", short_help="Print the table of a sweep.")(sweeping.sweep_table)
app.command(name="sweep-plot", short_help="Draw the results of a sweep.")(sweeping.sweep_plot)
app.command(name="sweep-cancel", short_help="Cancel the runs of a sweep.")(sweeping.sweep_cancel)


app.command(name="import", short_help="Convert a deck of another code to a case.")(import_deck)


@app.command(name="run", short_help="Run a case on this machine: start, watch, check, draw.")
def run_case(
    case: CaseArgument,
    ranks: Ranks = None,
    threads: Annotated[
        int | None,
        typer.Option("--threads", min=1, help="Threads of each rank; default: those of the case, else all cores."),
    ] = None,
    overrides: Overrides = None,
    out: Annotated[Path, typer.Option("--out", help="Folder of the runs.")] = Path("runs/local"),
    picture: Annotated[Path | None, typer.Option("--view", help="PNG file for a picture of the last frame.")] = None,
    field: Annotated[str | None, typer.Option("--field", help=f"Field of the picture: {', '.join(FIELDS)}.")] = None,
    plain: Annotated[bool, typer.Option("--plain", help="Print text lines instead of the panel.")] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Exit code 1 if a reference number is not reproduced.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the outcome as JSON and nothing else.")] = False,
) -> None:
    """Run a case on this machine: start a server, submit, watch, check, draw, stop the server. Ctrl-C cancels the
    run."""
    chosen = [*(overrides or ()), *on_cores(ranks, threads)]
    raise typer.Exit(run_once(case, chosen, out, picture, field, plain=plain, check=check, as_json=as_json))


@app.command(short_help="Run the demonstration: a steel bar breaks a glass bar.")
def demo(
    out: Annotated[Path, typer.Option("--out", help="Picture of the last frame.")] = Path("demo.png"),
    ranks: Ranks = None,
) -> None:
    """Run the case glass_steel_demo on this machine, check its reference numbers, and draw its last frame.

    The demonstration takes about ten seconds and needs only this installation; the run is stored below runs/local.
    """
    raise typer.Exit(run_once("glass_steel_demo", on_cores(ranks, None), Path("runs/local"), out, check=True))


app.add_typer(shipped.cases, name="cases")
app.command(short_help="Print the keys of a case, as JSON schema or as a page.")(shipped.schema)
app.command(short_help="List the material library, or one material.")(shipped.materials)


def main() -> None:
    """Entry point of the command ``conoid``."""
    prepare()
    app()


if __name__ == "__main__":
    main()
