"""The command ``conoid import``: it makes a case from a deck and writes the account of the import."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from conoid.cases.figures import counted
from conoid.cases.reference import json_schema
from conoid.cases.run import ExitCode

from ..commands.console import echo
from ..commands.options import Json, aloud, complain
from ..errors import ClientError, UsageError
from ..local.atomic import save_text
from .dialects import DIALECTS
from .importing import Imported, as_json, lines, read_deck
from .toml import NOTE

_FORMATS = ", ".join(DIALECTS)
_SHOWN = 20
"""Number of reasons of a refusal that are printed (chosen value: they fit on a screen; the account file has all
reasons)."""


def import_deck(
    deck: Annotated[Path, typer.Argument(metavar="DECK", help="LS-DYNA .k, Abaqus .inp or Radioss NAME_0000.rad.")],
    units: Annotated[
        str | None,
        typer.Option(
            "--units",
            metavar="L,M,T",
            help="Units of the deck, such as 'mm,t,s'; default: found from a material with the density of steel.",
        ),
    ] = None,
    kind: Annotated[
        str | None, typer.Option("--format", help=f"{_FORMATS}; default: recognised from the file.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Name of the case file; default: DECK with the ending .toml.")
    ] = None,
    anyway: Annotated[
        bool,
        typer.Option("--anyway", help="Write the case even if keywords are not translated, and list these keywords."),
    ] = False,
    as_data: Json = False,
) -> None:
    """Make a case from a deck of LS-DYNA, Abaqus/Explicit or Radioss.

    The command also writes an account of the import, NAME.import.txt (with --json: NAME.import.json). The account has
    every keyword of the deck with its key in the case, or the reason why it has none. The parts read their mesh from
    the deck. docs/howto/import.md lists the translated keywords.

    The import is refused if Conoid lacks a feature without which the answer would be wrong; the message names the
    feature. --anyway writes the case even then.
    """
    target = out or deck.with_suffix(".toml")
    if target.suffix != ".toml":
        raise UsageError(f"--out = {str(target)!r}: the name of a case file ends in .toml")
    if target.exists():
        raise ClientError(f"{target} already exists; name another file with --out")
    with aloud(f"reading {deck.name}"):
        found = _placed(read_deck(deck, units, kind), target)
    written = anyway or not found.refusals
    listed = target.with_name(f"{target.stem}.import.{'json' if as_data else 'txt'}")
    text = as_json(found, target.name) if as_data else "\n".join(lines(found, target.name)) + "\n"
    echo(text, nl=False)
    save_text(listed, text)
    made = [target, target.with_name(json_schema.FILE), listed] if written else [listed]
    if written:
        save_text(target, _noted(found).toml)
        save_text(made[1], json_schema.schema_text())
    if not as_data:
        echo(f"\nwritten: {', '.join(map(str, made))}")
    _end(found, target, written)


def _placed(found: Imported, target: Path) -> Imported:
    """Returns the imported case; its path of the deck is relative to the folder of the case file."""
    away = Path(os.path.relpath(found.deck.resolve(), target.resolve().parent)).as_posix()
    parts = [{**part, "mesh": {**part["mesh"], "path": away}} for part in found.data["parts"]]
    return replace(found, data={**found.data, "parts": parts})


def _noted(found: Imported) -> Imported:
    """Returns the imported case with its missing features as comments at the top of the text."""
    lacking = [f"NOT TRANSLATED: {line}" for line in found.refusals]
    head = [f"Imported from {found.deck.name}, {found.kind}, in {found.system}: {found.why}", *lacking]
    data: dict[str, Any] = {NOTE: head, **found.data}
    return replace(found, data=data)


def _end(found: Imported, target: Path, written: bool) -> None:
    if not found.refusals:
        return
    many = counted(len(found.refusals), "thing")
    if written:
        complain(
            f"warning: {target.name} lacks {many} and may give wrong results; the comments at its top list what is "
            "missing"
        )
        return
    complain(*found.refusals[:_SHOWN])
    more = f" ({len(found.refusals) - _SHOWN} more in the list)" if len(found.refusals) > _SHOWN else ""
    complain(f"no case was written: without {many} it may give wrong results{more}; --anyway writes it")
    raise typer.Exit(ExitCode.BAD_INPUT)
