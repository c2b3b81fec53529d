"""``conoid runs``: which run was it."""

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
"""Values that are told of a run, at most. Chosen: as many as a line has room for."""


Words = Annotated[
    list[str] | None,
    typer.Argument(metavar="[WORD]...", help="Words: each in the name, title, a label, the state or the message."),
]
Case = Annotated[str, typer.Option("--case", help="Name of the case; * stands for any letters.")]
States = Annotated[list[State] | None, typer.Option("--state", help="Only runs in this state; may be repeated.")]
Since = Annotated[str, typer.Option("--since", metavar="WHEN", help="Submitted then or later: a date, today, 3d, 12h.")]
Until = Annotated[str, typer.Option("--until", metavar="WHEN", help="Submitted before that.")]
Limit = Annotated[int, typer.Option("--limit", min=1, help="At most so many.")]


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
    """List runs, newest first, with the values of their cases that differ.

    The ids are short: each is the beginning that no other run has, and every command takes it.
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
        echo("no runs" if not (text or case or state or label or since or until) else "no run is like this")
