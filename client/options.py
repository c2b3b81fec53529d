"""What the commands have in common: options, how a run is found, how things are printed."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
from rich.console import Console, RenderableType

from conoid.cases.load import materials, shipped

from .errors import ClientError
from .result import Result
from .run import Run
from .session import Session, connect

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
SourceArgument = Annotated[str, typer.Argument(metavar="RUN", help="The id of a run, 'last', or its folder.")]


def complain(*lines: str) -> None:
    """Tells people what is wrong, a line each."""
    for line in lines:
        typer.echo(f"conoid: {line}", err=True)


def show(thing: RenderableType) -> None:
    """Prints for people."""
    Console(highlight=False).print(thing)


def show_json(thing: Any) -> None:
    """Prints for scripts: one JSON document."""
    typer.echo(msgspec.json.format(msgspec.json.encode(thing), indent=2).decode())


def find(session: Session, run: str) -> Run:
    """The run of an id, or the newest one for ``last``. Raises ClientError when there is none yet."""
    if run != "last":
        return session.run(run)
    newest = session.runs(limit=1)
    if not newest:
        raise ClientError("there is no run yet")
    return session.run(newest[0].id)


@contextmanager
def opened(source: str, url: str | None, token: str | None) -> Iterator[Result]:
    """The result of a run by its id, or in its folder."""
    if Path(source).is_dir():
        yield Result.open(source)
        return
    with connect(url, token) as session:
        yield find(session, source).result()
