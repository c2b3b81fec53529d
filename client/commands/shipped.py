"""Commands for files of the installation: keys of a case, shipped cases, material library."""

from pathlib import Path
from typing import Annotated

import typer

from conoid.cases import load
from conoid.cases.reading import files, library
from conoid.cases.reference import json_schema
from conoid.cases.reference.page import page

from ..errors import ClientError, UsageError
from ..local.atomic import save_text
from . import tables
from .console import echo, echo_json
from .options import Json, complete_cases, complete_materials, show

cases = typer.Typer(invoke_without_command=True, help="List the shipped cases, or copy one of them.")
OutOption = Annotated[Path | None, typer.Option("--out", help="File to write.")]


def schema(
    as_page: Annotated[
        bool, typer.Option("--page", help="Print a Markdown page (docs/reference/case.md) instead of the JSON schema.")
    ] = False,
    out: OutOption = None,
) -> None:
    """Print the keys of a case: as JSON schema for editors, or as a page with unit, range, default and meaning."""
    text = page() if as_page else json_schema.schema_text()
    if out is None:
        echo(text, nl=False)
    else:
        save_text(out, text)


def materials(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Name of a material.", autocompletion=complete_materials)
    ] = None,
    as_json: Json = False,
) -> None:
    """List the material library, or all constants of one material with their sources."""
    if name is None:
        known = library.library()
        if as_json:
            echo_json(sorted(known))
        else:
            show(tables.materials_table(known))
        return
    found = library.constants(name)
    if as_json:
        echo_json(found)
        return
    show(f"{name}: {library.library()[name].description}")
    show(tables.constants_table(found))
    show("")
    show(tables.sources_table(found))


@cases.callback()
def list_cases(ctx: typer.Context, as_json: Json = False) -> None:
    """List the shipped cases: name, title and cost."""
    if ctx.invoked_subcommand is not None:
        return
    known = {name: load.read_case(path) for name, path in load.shipped().items()}
    if as_json:
        echo_json(
            [{"name": name, "title": case.title, "description": case.description} for name, case in known.items()]
        )
    else:
        show(tables.cases_table(known))


@cases.command(name="copy")
def copy_case(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A shipped case.", autocompletion=complete_cases)],
    out: OutOption = None,
) -> None:
    """Copy a shipped case into the current folder, with the files that the case names, and the JSON schema with
    which editors complete keys.
    """
    shipped = load.shipped_path(name)
    text = shipped.read_text(encoding="utf-8")
    target = out or Path(f"{name}.toml")
    if target.suffix != ".toml":
        raise UsageError(f"--out = {str(target)!r}: the name of a case file ends in .toml")
    named = {file.path: target.with_name(file.path) for file in files.files_of(load.toml_data(text))}
    for each in (target, *named.values()):
        if each.exists():
            raise ClientError(f"{each} already exists; name another file with --out")
    save_text(
        target, text.replace(f"{json_schema.LINE} ../{json_schema.FILE}", f"{json_schema.LINE} ./{json_schema.FILE}", 1)
    )
    echo(str(target))
    for path, copy in named.items():
        save_text(copy, shipped.with_name(path).read_bytes())
        echo(str(copy))
    save_text(target.with_name(json_schema.FILE), json_schema.schema_text())
    echo(str(target.with_name(json_schema.FILE)))
