"""The command ``conoid runs``: it lists the runs of a server."""

from typing import Annotated

import typer

from conoid.cases.run import State

from ..remote.rows import differing
from ..remote.session import connect
from . import tables
from .console import echo, echo_json
from .options import Json, Labels, Token, Url, labels_of, show_lines
from .times import moment

_VALUES = 4
"""Largest number of values of the case that are shown for a run (chosen value: as many as fit into a text line)."""


Words = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[WORD]...", help="Words that must all occur in name, title, labels, state or message of a run."
    ),
]
Case = Annotated[str, typer.Option("--case", help="Name of the case; * stands for any characters.")]
States = Annotated[list[State] | None, typer.Option("--state", help="Only runs in this state; may be repeated.")]
Since = Annotated[
    str,
    typer.Option("--since", metavar="WHEN", help="Only runs submitted at this time or later: a date, today, 3d, 12h."),
]
Until = Annotated[str, typer.Option("--until", metavar="WHEN", help="Submitted before this time.")]
Limit = Annotated[int, typer.Option("--limit", min=1, help="Largest number of runs.")]


def runs(
    text: Words = None,
    case: Case = "",
    state: States = None,
    label: Labels = None,
    since: Since = "",
    until: Until = "",
    limit: Limit = 20,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """List runs, newest first, with those values of their cases that differ between the runs.

    The list shows short ids: the shortest unique prefix of each id. Every command accepts such a prefix.
    """
    first = moment(since, "--since") if since else None
    last = moment(until, "--until") if until else None
    states, words = [one.value for one in state or ()], " ".join(text or ())
    with connect(url, token) as session:
        rows = session.table(states, limit, labels_of(label), case=case, text=words, since=first, until=last)
    if as_json:
        echo_json([tables.row_of(row) for row in rows])
    elif rows:
        show_lines(tables.runs_table(rows, differing(rows, _VALUES)))
    else:
        echo("no runs" if not (text or case or state or label or since or until) else "no run matches")
