"""The history of a run, read from its file, with a warning if rows are missing."""

import warnings
from array import array
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise

from conoid.cases.figures import si
from conoid.cases.outcome import Outcome
from conoid.cases.run import State

from .columns import Columns, read_columns
from .errors import ClientError, UnfinishedError

_ROUNDING = 1e-9
"""Relative difference up to which the last time of the history counts as equal to the end time of the run."""


def read_history(text: str, name: str, outcome: Callable[[], Outcome]) -> Columns:
    """Returns the columns of a history. ``name``: name of the file; ``outcome``: function that returns the outcome of
    the run, or raises ClientError.

    Raises UnfinishedError for a file without columns. Gives a warning if the times do not increase, or if the
    history ends before the end of a successful run.
    """
    found = read_columns(text)
    if not found:
        raise UnfinishedError(f"{name} has no columns")
    ended: Outcome | None = None
    with suppress(ClientError):
        ended = outcome()
    if problem := _lost(found, ended):
        warnings.warn(f"{name}: {problem}", stacklevel=3)
    return found


def _lost(history: Columns, ended: Outcome | None) -> str:
    """Returns a text about missing or damaged rows; empty if the history is complete."""
    times = history.get("t")
    if times is None:
        return ""
    if not isinstance(times, array):
        return "the file is damaged: a time is not a number"
    if any(later < before for before, later in pairwise(times)):
        return "the file is damaged: its lines are not in the order of time"
    last = times[-1] if times else 0.0
    if ended is not None and ended.state == State.SUCCEEDED and last < (ended.time or 0.0) * (1.0 - _ROUNDING):
        return f"the lines end at {si(last, 's')}, the run at {si(ended.time, 's')}; the last lines are missing"
    return ""
