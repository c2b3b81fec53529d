"""The command ``conoid bench``: it measures the speed-up of a case."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.figures import counted, duration
from conoid.cases.model.run import MOST_RANKS, MOST_THREADS
from conoid.cases.reading.problems import shown
from conoid.cases.run import ExitCode
from conoid.cases.units import parse_quantity

from ..errors import UsageError
from ..local.atomic import save_text
from ..remote.submission import case_of
from ..studies import chart, study
from ..studies.projection import Network, bandwidth
from ..studies.scaling import CORES, Layout, scale
from .console import echo
from .options import CaseArgument, Overrides, aloud, complain

bench = typer.Typer(no_args_is_help=True, help="Measure speed-up and scaling.")


@bench.command(name="scale", short_help="Measure the speed-up of a case on several numbers of ranks and threads.")
def bench_scale(
    case: CaseArgument,
    ranks: Annotated[
        str,
        typer.Option(
            "--ranks", metavar="R,RxT,...", help="Numbers of ranks, or of ranks x threads; 1 is always included."
        ),
    ] = "1,2,4,8",
    overrides: Overrides = None,
    latency: Annotated[str, typer.Option("--latency", help="Latency of an MPI message, for the projection.")] = "2 us",
    width: Annotated[
        str, typer.Option("--bandwidth", help="Bandwidth of the messages of one rank, for the projection.")
    ] = "5 GB/s",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for scale.md, .json, .svg and the runs; runs in it are used again."),
    ] = None,
) -> None:
    """Run a case on several numbers of ranks and threads; print the speed-up, its losses, and whether all answers are
    equal.

    If a run has more threads than the machine has cores, its time is projected from the measured times of the tasks.
    Exit code 1 if answers differ.
    """
    layouts = layouts_of(ranks)
    network = Network(_read("--latency", latency, _time), _read("--bandwidth", width, bandwidth))
    with tempfile.TemporaryDirectory() as passing, aloud("the first run") as name:
        runs = []
        for run in scale(case, overrides or (), layouts, out or Path(passing), network):
            complain(f"{run.name}: {counted(run.steps, 'step')} in {duration(run.wall)}")
            runs.append(run)
            name(f"the run after {run.name}")
    done = study.Study(case_of(case, overrides or ()).name, overrides or (), CORES, network, runs)
    if out is not None:
        save_text(out / "scale.md", study.to_markdown(done))
        save_text(out / "scale.json", study.to_json(done))
        save_text(out / "scale.svg", chart.speed_up(done))
    echo(study.to_markdown(done), nl=False)
    raise typer.Exit(ExitCode.SUCCEEDED if done.equal else ExitCode.CRASHED)


def layouts_of(text: str) -> list[Layout]:
    """Returns the layouts (numbers of ranks, and of threads for each rank) of a text such as ``1,2,4x4``. Raises
    ClientError.
    """
    found = []
    for word in text.split(","):
        numbers = [int(each[:9]) if each.isascii() and each.isdigit() else 0 for each in word.strip().split("x")]
        ranks, threads = (*numbers, 1)[:2]
        if len(numbers) > 2 or not 1 <= ranks <= MOST_RANKS or not 1 <= threads <= MOST_THREADS:
            most = f"up to {MOST_RANKS} ranks, up to {MOST_THREADS} threads"
            message = (
                f"allowed: numbers of ranks, or ranks x threads, with commas between them, such as 1,2,4x4; {most}"
            )
            raise UsageError(f"--ranks = {shown(text)}: {message}")
        found.append((ranks, threads))
    return found


def _read(option: str, text: str, reading: Callable[[str], float]) -> float:
    """Reads the value of an option with the function ``reading``. Raises ClientError with the name of the option."""
    try:
        return reading(text)
    except ValueError as error:
        raise UsageError(f"{option} = {shown(text)}: {str(error).removeprefix(f'{text!r} ')}") from None


def _time(text: str) -> float:
    return parse_quantity(text, "s")
