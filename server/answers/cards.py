"""The cards of runs (module ``card``) in the database. Cards can be made again from the folders of the runs."""

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
"""Time in s for which one request makes missing cards (chosen value); it is enough for some hundred cards."""


class Cards:
    """Reads cards from the database and makes missing ones. All methods of this class may be called from any thread."""

    def __init__(self, runs: Path, store: Store) -> None:
        """Stores the path of ``runs``, the folder of all runs. The constructor reads no card."""
        self._runs, self._store = runs, store

    def of(self, runs: Sequence[Run]) -> dict[str, Card]:
        """Returns cards by run id. The result lacks runs whose cards could not be made in time. Raises
        SQLAlchemyError.
        """
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
        """Stores cards. If the cards cannot be stored, the next request makes the cards again."""
        try:
            self._store.keep_cards(made, {each.run: found[each.run].title for each in made})
        except SQLAlchemyError:
            return


def _read(kept: KeptCard | None, run: Run) -> Card | None:
    """Returns the stored card of a run; None if it was made before the run reached its present state."""
    if kept is None or kept.form != card.FORM or kept.final != run.state.final:
        return None
    try:
        return card.unpacked(kept.body)
    except (msgspec.MsgspecError, zlib.error):
        return None
