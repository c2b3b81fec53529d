"""Commands that measure."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.figures import counted, duration
from conoid.cases.problems import shown
from conoid.cases.run import ExitCode
from conoid.cases.schema import MOST_RANKS
from conoid.cases.units import parse_quantity

from . import chart, study
from .console import echo
from .errors import UsageError
from .options import CaseArgument, Overrides, aloud, complain
from .projection import Network, bandwidth
from .saving import save_text
from .scaling import CORES, scale
from .submission import case_of

bench = typer.Typer(no_args_is_help=True, help="Measure.")


@bench.command(name="scale", short_help="Run a case on several numbers of ranks; speed-up, projected beyond the cores.")
def bench_scale(
    case: CaseArgument,
    ranks: Annotated[str, typer.Option("--ranks", help="Numbers of ranks; one is always among them.")] = "1,2,4,8",
    overrides: Overrides = None,
    latency: Annotated[str, typer.Option("--latency", help="Of a message, for the projection.")] = "2 us",
    width: Annotated[str, typer.Option("--bandwidth", help="Of a rank's messages, for the projection.")] = "5 GB/s",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", help="Folder for scale.md, .json and .svg and for the runs; those of an earlier call are read."
        ),
    ] = None,
) -> None:
    """Run a case on several numbers of ranks: speed-up, where it is lost, and whether all give the same answer.

    Ends with 1 when they do not.
    """
    numbers = _numbers(ranks)
    network = Network(_read("--latency", latency, _time), _read("--bandwidth", width, bandwidth))
    with tempfile.TemporaryDirectory() as passing, aloud(f"0 of {len(numbers)} runs have ended") as name:
        runs = []
        for run in scale(case, overrides or (), numbers, out or Path(passing), network):
            complain(f"ranks {run.ranks}: {counted(run.steps, 'step')} in {duration(run.wall)}")
            runs.append(run)
            name(f"{len(runs)} of {len(numbers)} runs have ended")
    done = study.Study(case_of(case, overrides or ()).name, overrides or (), CORES, network, runs)
    if out is not None:
        save_text(out / "scale.md", study.to_markdown(done))
        save_text(out / "scale.json", study.to_json(done))
        save_text(out / "scale.svg", chart.speed_up(done))
    echo(study.to_markdown(done), nl=False)
    raise typer.Exit(ExitCode.SUCCEEDED if done.equal else ExitCode.CRASHED)


def _numbers(text: str) -> list[int]:
    """Numbers of ranks such as ``1,2,4``. Raises ClientError."""
    words = [word.strip() for word in text.split(",")]
    if not all(word.isascii() and word.isdigit() and 1 <= int(word[:9]) <= MOST_RANKS for word in words):
        message = f"allowed: whole numbers from 1 to {MOST_RANKS} with commas between them, such as 1,2,4"
        raise UsageError(f"--ranks = {shown(text)}: {message}")
    return [int(word) for word in words]


def _read(option: str, text: str, reading: Callable[[str], float]) -> float:
    """What an option says. Raises ClientError that names it."""
    try:
        return reading(text)
    except ValueError as error:
        raise UsageError(f"{option} = {shown(text)}: {str(error).removeprefix(f'{text!r} ')}") from None


def _time(text: str) -> float:
    return parse_quantity(text, "s")
