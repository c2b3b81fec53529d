"""Definitions that several commands use: options, selection of a run, output."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

import typer
from rich.console import RenderableType

from conoid.cases.estimates.estimate import estimate
from conoid.cases.figures import duration
from conoid.cases.load import CaseError, materials, parse_case, shipped
from conoid.cases.reading.problems import Problem, shown
from conoid.cases.reading.survey import Survey
from conoid.cases.warnings.plausible import bare_numbers
from conoid.cases.warnings.touching import touching
from conoid.cases.warnings.warned import warned

from ..errors import NotFoundError, UsageError
from ..remote.session import Session, connect
from ..remote.submission import data_of, locate
from ..result import Result
from ..run import Run
from . import progress
from .console import PlainConsole, echo, one_line

_MOST_WARNINGS = 12
"""Largest number of warnings that are printed (chosen value: they fill half a screen)."""

_RARER = 1.2
"""Factor by which the time between two progress lines grows from line to line (chosen value: a command of one day
prints about forty lines)."""

_NO_WIDTH = 1000
"""Width of a text line in a file or a pipe, characters (chosen value: wider than any table)."""

FILE_OPTIONS = ("--out", "--view", "--list", "--runs", "--site")
"""Options whose value is the name of a file or a folder."""

Url = Annotated[
    str | None, typer.Option("--url", help="Address of the server; default: CONOID_URL or the configuration file.")
]
Token = Annotated[
    str | None, typer.Option("--token", help="Token of the user; default: CONOID_TOKEN or the configuration file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


def complete_cases(incomplete: str) -> list[str]:
    """Completes names of shipped cases for the shell."""
    return [name for name in shipped() if name.startswith(incomplete)]


def complete_materials(incomplete: str) -> list[str]:
    """Completes names of the material library for the shell."""
    return [name for name in materials() if name.startswith(incomplete)]


def _complete_files(incomplete: str) -> list[str]:
    """Completes shipped cases, case files and folders for the shell."""
    folder, _, start = incomplete.rpartition("/")
    try:
        found = sorted(Path(folder or ("/" if incomplete.startswith("/") else ".")).iterdir())
    except OSError:
        found = []
    near = [path for path in found if path.name.startswith(start) and not path.name.startswith(".")]
    files = [path for path in near if path.suffix in (".toml", ".json") or path.is_dir()]
    return [*complete_cases(incomplete), *(f"{path}/" if path.is_dir() else str(path) for path in files)]


def named(text: str) -> str:
    """Returns an argument that names a run or a sweep: an id or a folder. Raises UsageError if the text is empty, as
    from an unset variable. Raises NotFoundError if the text is a path and no folder; an id contains no ``/``.
    """
    sweep_named(text)
    if ("/" in text or "\0" in text) and folder_of(text) is None:
        raise NotFoundError(f"{text}: this is not the folder of a run; write the folder or the id of a run, or 'last'")
    return text


def sweep_named(text: str) -> str:
    """Returns an argument that names a sweep. Raises UsageError for an empty text."""
    if not text.strip():
        raise UsageError("the name of the sweep is empty: write an id, or 'last'")
    return text


def folder_of(text: str) -> Path | None:
    """Returns the path of an existing folder; None if there is no folder with this name."""
    try:
        return Path(text) if Path(text).is_dir() else None
    except (OSError, ValueError):  # The name is too long or not allowed.
        return None


CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE", help="A .toml or .json file, or the name of a shipped case.", autocompletion=_complete_files
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the case, such as run.end_time='20 us'."),
]
Ranks = Annotated[
    int | None, typer.Option("--ranks", min=1, help="Number of MPI ranks; default: run.ranks of the case.")
]
Threads = Annotated[
    int | None, typer.Option("--threads", min=1, help="Threads of each rank; default: run.threads of the case.")
]
MaxSteps = Annotated[
    int | None, typer.Option("--max-steps", min=1, help="run.max_steps of the new run; default: as in the old run.")
]
Labels = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="NAME=VALUE", help="Label to find runs again; may be repeated."),
]
SourceArgument = Annotated[
    str,
    typer.Argument(
        metavar="RUN", callback=named, help="The id of a run, the beginning of an id, 'last', or a run folder."
    ),
]


def on_cores(ranks: int | None, threads: int | None) -> list[str]:
    """Returns the overrides of the case for the options ``--ranks`` and ``--threads``."""
    chosen = (("run.ranks", ranks), ("run.threads", threads))
    return [f"{key}={number}" for key, number in chosen if number is not None]


def labels_of(words: Sequence[str] | None) -> dict[str, str]:
    """Returns the labels from words of the form ``NAME=VALUE``. Raises ClientError."""
    pairs = [word.partition("=") for word in words or ()]
    for name, equals, _ in pairs:
        if not (name and equals):
            raise UsageError(f"label = {name!r}: write NAME=VALUE")
    labels = {name: value for name, _, value in pairs}
    if len(labels) < len(pairs):
        raise UsageError(f"label: each name may have only one value; given are {', '.join(words or ())}")
    return labels


def complain(*lines: str) -> None:
    """Prints problems, each in one line."""
    for line in lines:
        echo(f"conoid: {one_line(line)}", err=True)


def warn(odd: Sequence[Problem]) -> None:
    """Prints warnings, each in one line, and the number of warnings that are left out."""
    complain(*(f"warning: {each}" for each in odd[:_MOST_WARNINGS]))
    if len(odd) > _MOST_WARNINGS:
        complain(f"warning: {len(odd) - _MOST_WARNINGS} more warnings; conoid validate --json prints all")


def warn_of(case: str, overrides: Iterable[str]) -> None:
    """Prints the warnings of a case before its run; the caller reports errors of the case."""
    with suppress(CaseError, ArithmeticError):
        data = data_of(case, overrides)
        checked = parse_case(data)
        expected = estimate(checked, locate(case).parent)
        warn([*bare_numbers(data), *warned(checked, expected, Survey(), touching(checked))])


def show(thing: RenderableType) -> None:
    """Prints a text, a table or a panel."""
    PlainConsole().print(thing)


def show_lines(rows: RenderableType) -> None:
    """Prints a table with one text line for each entry. Without a terminal the width is unlimited, so that lines
    stay whole.
    """
    console = PlainConsole()
    if not console.is_terminal:
        console.width = _NO_WIDTH
    console.print(rows)


@contextmanager
def aloud(what: str) -> Iterator[Callable[[str], None]]:
    """Prints progress lines with the text ``what`` while the code inside of the ``with`` block takes long; the lines
    become rarer with time.
    """
    at, began, due = what, time.monotonic(), 0.0

    def name(now: str) -> None:
        nonlocal at
        at = now

    def say(text: str) -> None:
        nonlocal due
        spent = time.monotonic() - began
        if spent >= due:
            complain(text)
            due = _RARER * spent

    with progress.broken(say, lambda: f"{at}, {duration(time.monotonic() - began)} so far"):
        yield name


def find(session: Session, run: str) -> Run:
    """Returns a run by its id or a prefix of the id; ``last`` means the newest run. Raises NotFoundError,
    UsageError.
    """
    if "/" in run:
        raise UsageError(f"run = {shown(run)}: this command needs a server; write the id of a run, or 'last'")
    return session.run(run)


@contextmanager
def opened(source: str, url: str | None, token: str | None) -> Iterator[Result]:
    """Yields the result of a run for a ``with`` block; ``source``: id or folder of the run."""
    if (folder := folder_of(source)) is not None:
        yield Result.open(folder)
        return
    with connect(url, token) as session:
        yield find(session, source).result()
