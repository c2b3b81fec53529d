"""What the commands have in common: options, how a run is found, how things are printed."""

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
"""Lines of warnings that are printed. Chosen: half a screen."""

_RARER = 1.2
"""From one word to the next, over the time that something takes. Chosen: some forty words in a day."""

_NO_WIDTH = 1000
"""Characters of a line in a file or a pipe. Chosen: more than any table needs."""

Url = Annotated[str | None, typer.Option("--url", help="The server [CONOID_URL, or the configuration file].")]
Token = Annotated[str | None, typer.Option("--token", help="Who asks [CONOID_TOKEN, or the configuration file].")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


def complete_cases(incomplete: str) -> list[str]:
    """Names of shipped cases, for the shell."""
    return [name for name in shipped() if name.startswith(incomplete)]


def complete_materials(incomplete: str) -> list[str]:
    """Names of the material library, for the shell."""
    return [name for name in materials() if name.startswith(incomplete)]


def _complete_files(incomplete: str) -> list[str]:
    """Shipped cases, case files and folders, for the shell."""
    folder, _, start = incomplete.rpartition("/")
    try:
        found = sorted(Path(folder or ("/" if incomplete.startswith("/") else ".")).iterdir())
    except OSError:
        found = []
    near = [path for path in found if path.name.startswith(start) and not path.name.startswith(".")]
    files = [path for path in near if path.suffix in (".toml", ".json") or path.is_dir()]
    return [*complete_cases(incomplete), *(f"{path}/" if path.is_dir() else str(path) for path in files)]


def named(text: str) -> str:
    """The id of a run or a sweep as it was given, or a folder. Raises UsageError for an empty one: a variable that is
    not set; NotFoundError for a path at which there is no folder: no id has a ``/``.
    """
    sweep_named(text)
    if ("/" in text or "\0" in text) and folder_of(text) is None:
        raise NotFoundError(f"{text}: this is no folder of a run; write its folder, its id, or 'last'")
    return text


def sweep_named(text: str) -> str:
    """The id of a sweep as it was given. Raises UsageError for an empty one."""
    if not text.strip():
        raise UsageError("the name is empty: write an id, or 'last'")
    return text


def folder_of(text: str) -> Path | None:
    """The folder that is meant, None where there is none of this name."""
    try:
        return Path(text) if Path(text).is_dir() else None
    except (OSError, ValueError):  # a name that is too long, or that no file can have
        return None


CaseArgument = Annotated[
    str,
    typer.Argument(
        metavar="CASE", help="A .toml or .json file, or a shipped case by name.", autocompletion=_complete_files
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the case, as run.end_time='20 us'."),
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
    typer.Option("--label", metavar="NAME=VALUE", help="By which runs are found again; may be repeated."),
]
SourceArgument = Annotated[
    str, typer.Argument(metavar="RUN", callback=named, help="The id of a run or its beginning, 'last', or its folder.")
]


def on_cores(ranks: int | None, threads: int | None) -> list[str]:
    """The overrides that these options stand for."""
    chosen = (("run.ranks", ranks), ("run.threads", threads))
    return [f"{key}={number}" for key, number in chosen if number is not None]


def labels_of(words: Sequence[str] | None) -> dict[str, str]:
    """Of ``NAME=VALUE``. Raises ClientError."""
    pairs = [word.partition("=") for word in words or ()]
    for name, equals, _ in pairs:
        if not (name and equals):
            raise UsageError(f"label = {name!r}: write NAME=VALUE")
    labels = {name: value for name, _, value in pairs}
    if len(labels) < len(pairs):
        raise UsageError(f"label: each has one value; given are {', '.join(words or ())}")
    return labels


def complain(*lines: str) -> None:
    """Tells people what is wrong, a line each."""
    for line in lines:
        echo(f"conoid: {one_line(line)}", err=True)


def warn(odd: Sequence[Problem]) -> None:
    """Tells people what is odd, a line each, and how many more there are."""
    complain(*(f"warning: {each}" for each in odd[:_MOST_WARNINGS]))
    if len(odd) > _MOST_WARNINGS:
        complain(f"warning: and {len(odd) - _MOST_WARNINGS} more; conoid validate --json has all")


def warn_of(case: str, overrides: Iterable[str]) -> None:
    """Tells what is odd with a case that is about to run; what is wrong with it is told by who runs it."""
    with suppress(CaseError, ArithmeticError):
        data = data_of(case, overrides)
        checked = parse_case(data)
        expected = estimate(checked, locate(case).parent)
        warn([*bare_numbers(data), *warned(checked, expected, Survey(), touching(checked))])


def show(thing: RenderableType) -> None:
    """Prints for people."""
    PlainConsole().print(thing)


def show_lines(rows: RenderableType) -> None:
    """Prints a table of one line an entry; what is not a terminal has no width, and gets the lines whole."""
    console = PlainConsole()
    if not console.is_terminal:
        console.width = _NO_WIDTH
    console.print(rows)


@contextmanager
def aloud(what: str) -> Iterator[Callable[[str], None]]:
    """While what is done inside takes long, people are told ``what`` it is at, or what it was last called with; of what
    takes hours more and more rarely.
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
    """The run of an id or its beginning, or the newest one for ``last``. Raises NotFoundError, UsageError."""
    if "/" in run:
        raise UsageError(f"run = {shown(run)}: this asks a server; write the id of a run, or 'last'")
    return session.run(run)


@contextmanager
def opened(source: str, url: str | None, token: str | None) -> Iterator[Result]:
    """The result of a run by its id, or in its folder."""
    if (folder := folder_of(source)) is not None:
        yield Result.open(folder)
        return
    with connect(url, token) as session:
        yield find(session, source).result()
