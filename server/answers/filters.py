"""Filters of a list of runs as SQL conditions: state, label, case, words and time."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sqlalchemy as sa

from conoid.cases.run import State

from ..database.tables import LABELS, RUNS

OPEN = [state.value for state in State if not state.final]
"""States of runs that have not ended."""
_ESCAPE = "\\"
_SPECIAL = re.compile(r"([\\%_])")
_Column = sa.ColumnElement[str]


@dataclass(frozen=True)
class Chosen:
    """Filters of a list of runs. A filter that is not set excludes no run. All times are Unix times in s."""

    states: Sequence[State] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    case: str = ""
    """Name of the case; ``*`` matches any characters."""
    words: Sequence[str] = ()
    """Words of a search. Each word must occur in the case's name or title, in a label, state, cause or message, or at
    the start of the id."""
    since: float | None = None
    """Earliest time of submission, inclusive."""
    until: float | None = None
    """Latest time of submission, exclusive."""
    runs: Sequence[str] | None = None
    """Ids of the runs that may be in the list; None: all runs."""
    changed: float | None = None
    """With this time, the list contains all open runs and the runs that were submitted or ended at this time or
    later."""

    def where(self, owner: str) -> Iterator[sa.ColumnElement[bool]]:
        """Yields the SQL conditions that a run in the list fulfils."""
        runs = RUNS.c
        yield runs.owner == owner
        if self.states:
            yield runs.state.in_([state.value for state in self.states])
        for name, value in self.labels.items():
            same = (LABELS.c.owner == owner, LABELS.c.name == name, LABELS.c.value == value)
            yield runs.id.in_(sa.select(LABELS.c.run).where(*same))
        if self.case:
            yield _like(runs.name, "%".join(map(_literal, self.case.split("*"))))
        yield from (_has(word) for word in self.words)
        if self.since is not None:
            yield runs.submitted >= self.since
        if self.until is not None:
            yield runs.submitted < self.until
        if self.runs is not None:
            yield runs.id.in_(self.runs)
        if self.changed is not None:
            yield sa.or_(runs.state.in_(OPEN), runs.finished >= self.changed, runs.submitted >= self.changed)


def _literal(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", text)


def _like(column: _Column, pattern: str) -> sa.ColumnElement[bool]:
    """Returns the condition that a column matches a pattern. Capital and small letters count as equal in every
    database.
    """
    return sa.func.lower(column).like(pattern.lower(), escape=_ESCAPE)


def _has(word: str) -> sa.ColumnElement[bool]:
    runs, anywhere = RUNS.c, f"%{_literal(word)}%"
    label = LABELS.c.name + "=" + LABELS.c.value
    labelled = sa.exists().where(LABELS.c.run == runs.id, _like(label, anywhere)).correlate(RUNS)
    texts = (runs.name, runs.title, runs.state, runs.cause, runs.message)
    return sa.or_(_like(runs.id, f"{_literal(word)}%"), *(_like(text, anywhere) for text in texts), labelled)
