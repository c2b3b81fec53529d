"""Common parts of the commands: options, selection of a run, output."""

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
"""Largest number of warnings that are printed. Chosen value: half a screen."""

_RARER = 1.2
"""Growth of the time between two progress lines, relative to the whole duration. Chosen value: a day has some forty
lines."""

_NO_WIDTH = 1000
"""Width of a line in a file or a pipe, characters. Chosen value: wider than any table."""

FILE_OPTIONS = ("--out", "--view", "--list", "--runs", "--site")
"""Options whose value is the name of a file or a folder."""

Url = Annotated[
    str | None, typer.Option("--url", help="Address of the server [CONOID_URL, or the configuration file].")
]
Token = Annotated[
    str | None, typer.Option("--token", help="Token of the user [CONOID_TOKEN, or the configuration file].")
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
    """Returns the given id of a run or a sweep, or a folder. Raises UsageError for an empty text, such as an unset
    variable; NotFoundError for a path without a folder: no id contains ``/``.
    """
    sweep_named(text)
    if ("/" in text or "\0" in text) and folder_of(text) is None:
        raise NotFoundError(f"{text}: not the folder of a run; write its folder, its id, or 'last'")
    return text


def sweep_named(text: str) -> str:
    """Returns the given id of a sweep. Raises UsageError for an empty text."""
    if not text.strip():
        raise UsageError("the name is empty: write an id, or 'last'")
    return text


def folder_of(text: str) -> Path | None:
    """Returns the path of a folder with this name; None without such a folder."""
    try:
        return Path(text) if Path(text).is_dir() else None
    except (OSError, ValueError):  # a name that is too long or not allowed
        return None


CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE", help="A .toml or .json file, or a shipped case by name.", autocompletion=_complete_files
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the case, such as run.end_time='20 us'."),
]
Ranks = Annotated[int | None, typer.Option("--ranks", min=1, help="MPI ranks; the case's own number if not given.")]
Threads = Annotated[
    int | None, typer.Option("--threads", min=1, help="Threads of each rank; the case's own number if not given.")
]
MaxSteps = Annotated[
    int | None, typer.Option("--max-steps", min=1, help="run.max_steps of the new run; the case's own if not given.")
]
Labels = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="NAME=VALUE", help="Label to find runs again; may be repeated."),
]
SourceArgument = Annotated[
    str, typer.Argument(metavar="RUN", callback=named, help="The id of a run or its beginning, 'last', or its folder.")
]


def on_cores(ranks: int | None, threads: int | None) -> list[str]:
    """Returns the overrides of these options."""
    chosen = (("run.ranks", ranks), ("run.threads", threads))
    return [f"{key}={number}" for key, number in chosen if number is not None]


def labels_of(words: Sequence[str] | None) -> dict[str, str]:
    """Returns labels of ``NAME=VALUE``. Raises ClientError."""
    pairs = [word.partition("=") for word in words or ()]
    for name, equals, _ in pairs:
        if not (name and equals):
            raise UsageError(f"label = {name!r}: write NAME=VALUE")
    labels = {name: value for name, _, value in pairs}
    if len(labels) < len(pairs):
        raise UsageError(f"label: each name may have one value; given are {', '.join(words or ())}")
    return labels


def complain(*lines: str) -> None:
    """Prints each problem in one line."""
    for line in lines:
        echo(f"conoid: {one_line(line)}", err=True)


def warn(odd: Sequence[Problem]) -> None:
    """Prints each warning in one line, and the number of warnings that are not printed."""
    complain(*(f"warning: {each}" for each in odd[:_MOST_WARNINGS]))
    if len(odd) > _MOST_WARNINGS:
        complain(f"warning: and {len(odd) - _MOST_WARNINGS} more; conoid validate --json has all")


def warn_of(case: str, overrides: Iterable[str]) -> None:
    """Prints the warnings of a case that is about to run; its errors are reported by the caller."""
    with suppress(CaseError, ArithmeticError):
        data = data_of(case, overrides)
        checked = parse_case(data)
        expected = estimate(checked, locate(case).parent)
        warn([*bare_numbers(data), *warned(checked, expected, Survey(), touching(checked))])


def show(thing: RenderableType) -> None:
    """Prints a text, a table or a panel."""
    PlainConsole().print(thing)


def show_lines(rows: RenderableType) -> None:
    """Prints a table with one line for each entry; without a terminal the width is unlimited and lines stay whole."""
    console = PlainConsole()
    if not console.is_terminal:
        console.width = _NO_WIDTH
    console.print(rows)


@contextmanager
def aloud(what: str) -> Iterator[Callable[[str], None]]:
    """Prints ``what`` is in progress while the block inside takes long; the lines become rarer with time."""
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
    """Returns the run of an id or a prefix of it, or the newest one for ``last``. Raises NotFoundError, UsageError."""
    if "/" in run:
        raise UsageError(f"run = {shown(run)}: this command needs a server; write the id of a run, or 'last'")
    return session.run(run)


@contextmanager
def opened(source: str, url: str | None, token: str | None) -> Iterator[Result]:
    """Returns the result of a run by its id or its folder."""
    if (folder := folder_of(source)) is not None:
        yield Result.open(folder)
        return
    with connect(url, token) as session:
        yield find(session, source).result()
