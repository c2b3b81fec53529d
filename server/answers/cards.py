"""The cards of runs, kept in the database: an index over the folders of runs, which can be made again from them."""

import time
import zlib
from collections.abc import Sequence
from pathlib import Path

import msgspec
from sqlalchemy.exc import SQLAlchemyError

from ..database.store import KeptCard, Store
from ..runs.events import Run
from . import card
from .card import Card

_PATIENCE = 0.5
"""s that a request spends on making cards; the next one goes on. Chosen: some hundred runs."""


class Cards:
    """May be used from any thread."""

    def __init__(self, runs: Path, store: Store) -> None:
        """``runs`` is the folder of all runs. Reads nothing yet."""
        self._runs, self._store = runs, store

    def of(self, runs: Sequence[Run]) -> dict[str, Card]:
        """Cards by the ids of the runs; without those that there was no time to make. Raises SQLAlchemyError."""
        known = {each.run: each for each in self._store.cards([run.id for run in runs])}
        found, made, until = dict[str, Card](), list[KeptCard](), time.monotonic() + _PATIENCE
        for run in runs:
            if (there := _read(known.get(run.id), run)) is not None:
                found[run.id] = there
            elif time.monotonic() < until:
                found[run.id] = card.of(self._runs / run.id, run.state.final)
                kept = KeptCard(run.id, card.FORM, run.state.final, card.packed(found[run.id]))
                made.append(kept)
        self._keep(made, found)
        return found

    def _keep(self, made: list[KeptCard], found: dict[str, Card]) -> None:
        """What cannot be kept now is made again when it is asked for."""
        try:
            self._store.keep_cards(made, {each.run: found[each.run].title for each in made})
        except SQLAlchemyError:
            return


def _read(kept: KeptCard | None, run: Run) -> Card | None:
    """The card that is kept, where it is the one of the run as it is now."""
    if kept is None or kept.form != card.FORM or kept.final != run.state.final:
        return None
    try:
        return card.unpacked(kept.body)
    except (msgspec.MsgspecError, zlib.error):
        return None
