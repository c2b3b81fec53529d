"""The server's tables: runs, labels, idempotency keys, tokens. SQLite by default, PostgreSQL by URL.

Runs, labels and keys are an index over the runs' folders and can be rebuilt from them; tokens live here only.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import msgspec
import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError

from conoid.cases.run import Cause, State

from ..answers.filters import OPEN, Chosen
from ..queue.usage import Took
from ..runs.events import Run
from .engine import engine_of, failure, identity_of
from .tables import BONDS, CARDS, KEYS, LABELS, META, RUNS, TOKENS

_ONLY = 1
"""The number of the one bond that there may be."""
_AT_ONCE = 500
"""Ids in one statement. Chosen: SQLite takes 999 in its older versions."""


@dataclass(frozen=True)
class Token:
    """A token as it is kept: never the secret, only its hash."""

    id: str
    owner: str
    sha256: str
    scopes: frozenset[str]
    created: float
    """Unix s."""


class Bond(msgspec.Struct, frozen=True):
    """Which server the folder of runs at ``place`` and a database belong to."""

    server: str
    place: str


@dataclass(frozen=True)
class KeptCard:
    """What is kept of a run for the table of runs (card.py); ``final``: it has ended."""

    run: str
    form: int
    final: bool
    body: bytes


class Store:
    """All methods may be called from any thread; each is one transaction and raises SQLAlchemyError when it fails."""

    def __init__(self, url: str | sa.URL) -> None:
        """Opens the database and makes its tables where they are missing. Raises StoreError."""
        try:
            self._engine = engine_of(url)
            self.unlabelled = not sa.inspect(self._engine).has_table(LABELS.name)
            """Whether the labels of all runs are to be read from their folders: the database is new, or an old one."""
            META.create_all(self._engine)
            _complete(self._engine)
            self._file = identity_of(self._engine)
        except (SQLAlchemyError, ImportError) as error:
            raise failure(url, error, "opened") from None

    def close(self) -> None:
        """Closes every connection."""
        self._engine.dispose()

    def probe(self) -> None:
        """Raises SQLAlchemyError when nothing can be written now, or what is written is in no file any more."""
        if identity_of(self._engine) != self._file:
            raise SQLAlchemyError("the file of the database has been removed or replaced")
        with self._engine.connect() as connection:
            if self._engine.dialect.name == "sqlite":
                connection.exec_driver_sql("begin immediate")
            else:
                connection.execute(sa.select(1))
            connection.rollback()

    # The server -------------------------------------------------------------------------------------------------------

    def bond(self) -> "Bond | None":
        """To which server and folder of runs the database belongs; None where it is new."""
        with self._engine.connect() as connection:
            row = connection.execute(sa.select(BONDS.c.server, BONDS.c.place)).first()
        return None if row is None else Bond(row[0], row[1])

    def bind(self, bond: "Bond") -> None:
        """The first bond; where another server has been faster, its bond stays."""
        with suppress(sa.exc.IntegrityError), self._engine.begin() as connection:
            connection.execute(sa.insert(BONDS).values(number=_ONLY, server=bond.server, place=bond.place))

    def rebind(self, bond: "Bond") -> None:
        """Another bond in the place of the one that there is."""
        with self._engine.begin() as connection:
            connection.execute(sa.delete(BONDS))
            connection.execute(sa.insert(BONDS).values(number=_ONLY, server=bond.server, place=bond.place))

    # Runs -------------------------------------------------------------------------------------------------------------

    def add(self, run: Run, key: str | None, labels: Mapping[str, str] | None = None) -> None:
        """A run, its labels, and the idempotency key that made it; adding it again changes its state and labels."""
        known = sa.select(KEYS.c.run).where(KEYS.c.owner == run.owner, KEYS.c.key == key)
        with self._engine.begin() as connection:
            self._put(connection, run)
            if key is not None and connection.execute(known).first() is None:
                connection.execute(sa.insert(KEYS).values(owner=run.owner, key=key, run=run.id))
            self._label(connection, run, labels or {})

    def relabel(self, run: Run, labels: Mapping[str, str]) -> None:
        """The labels of a run as they are now."""
        with self._engine.begin() as connection:
            self._label(connection, run, labels)

    @staticmethod
    def _label(connection: sa.Connection, run: Run, labels: Mapping[str, str]) -> None:
        connection.execute(sa.delete(LABELS).where(LABELS.c.run == run.id))
        if labels:
            rows = [{"run": run.id, "name": name, "owner": run.owner, "value": labels[name]} for name in labels]
            connection.execute(sa.insert(LABELS), rows)

    def labels(self, run_ids: Sequence[str]) -> dict[str, dict[str, str]]:
        """The labels of some runs, by their ids."""
        found: dict[str, dict[str, str]] = {run_id: {} for run_id in run_ids}
        with self._engine.connect() as connection:
            for some in _parts(run_ids):
                rows = connection.execute(sa.select(LABELS).where(LABELS.c.run.in_(some)))
                for run_id, name, _, value in rows:
                    found[run_id][name] = value
        return found

    def save(self, run: Run) -> None:
        """The run as it is now."""
        with self._engine.begin() as connection:
            self._put(connection, run)

    @staticmethod
    def _put(connection: sa.Connection, run: Run) -> None:
        values = {name: str(value) if isinstance(value, StrEnum) else value for name, value in asdict(run).items()}
        if connection.execute(sa.update(RUNS).where(RUNS.c.id == run.id).values(values)).rowcount == 0:
            connection.execute(sa.insert(RUNS).values(values))

    def all(self) -> list[Run]:
        """Every run of every owner."""
        with self._engine.connect() as connection:
            return [_run(row) for row in connection.execute(sa.select(RUNS)).mappings()]

    def get(self, run_id: str) -> Run | None:
        """The run, whoever owns it."""
        with self._engine.connect() as connection:
            row = connection.execute(sa.select(RUNS).where(RUNS.c.id == run_id)).mappings().first()
        return None if row is None else _run(row)

    def some(self, run_ids: Sequence[str]) -> dict[str, Run]:
        """Those of the runs that are known, whoever owns them, by their ids."""
        with self._engine.connect() as connection:
            rows = (connection.execute(sa.select(RUNS).where(RUNS.c.id.in_(some))) for some in _parts(run_ids))
            return {row["id"]: _run(row) for found in rows for row in found.mappings()}

    def page(self, owner: str, chosen: Chosen, before: str | None, limit: int) -> list[Run]:
        """At most ``limit`` of the ``chosen`` runs of ``owner``, newest first, older than the run ``before``."""
        query = sa.select(RUNS).where(*chosen.where(owner)).order_by(RUNS.c.id.desc()).limit(limit)
        if before is not None:
            query = query.where(RUNS.c.id < before)
        with self._engine.connect() as connection:
            return [_run(row) for row in connection.execute(query).mappings()]

    def ids_about(self, owner: str, first: str, last: str) -> list[str]:
        """The ids of all runs of ``owner`` from ``first`` to ``last``, sorted, with one neighbour at either end."""
        own = sa.select(RUNS.c.id).where(RUNS.c.owner == owner)
        before = own.where(RUNS.c.id < first).order_by(RUNS.c.id.desc()).limit(1)
        after = own.where(RUNS.c.id > last).order_by(RUNS.c.id).limit(1)
        within = own.where(RUNS.c.id.between(first, last)).order_by(RUNS.c.id)
        with self._engine.connect() as connection:
            return [run_id for query in (before, within, after) for (run_id,) in connection.execute(query)]

    def cards(self, run_ids: Sequence[str]) -> list[KeptCard]:
        """The cards of some runs, as far as they are kept."""
        with self._engine.connect() as connection:
            found = (connection.execute(sa.select(CARDS).where(CARDS.c.run.in_(some))) for some in _parts(run_ids))
            return [KeptCard(*row) for rows in found for row in rows]

    def keep_cards(self, cards: Sequence[KeptCard], titles: Mapping[str, str]) -> None:
        """Keeps cards in place of earlier ones of the same runs; runs of an old database get their ``titles``."""
        with self._engine.begin() as connection:
            for card in cards:
                connection.execute(sa.delete(CARDS).where(CARDS.c.run == card.run))
                connection.execute(sa.insert(CARDS).values(asdict(card)))
            for run_id, title in titles.items():
                untitled = sa.update(RUNS).where(RUNS.c.id == run_id, RUNS.c.title == "")
                connection.execute(untitled.values(title=title))

    def open_runs(self, owner: str) -> int:
        """How many runs of ``owner`` have not ended."""
        query = sa.select(sa.func.count()).select_from(RUNS).where(RUNS.c.owner == owner, RUNS.c.state.in_(OPEN))
        with self._engine.connect() as connection:
            return connection.execute(query).scalar_one()

    def ended(self) -> dict[str, State]:
        """All runs that are known to have ended: how, by id."""
        query = sa.select(RUNS.c.id, RUNS.c.state).where(RUNS.c.state.not_in(OPEN))
        with self._engine.connect() as connection:
            return {run_id: State(state) for run_id, state in connection.execute(query)}

    def open(self) -> dict[str, Run]:
        """All runs that are not known to have ended, by id."""
        query = sa.select(RUNS).where(RUNS.c.state.in_(OPEN))
        with self._engine.connect() as connection:
            return {row["id"]: _run(row) for row in connection.execute(query).mappings()}

    def taken(self) -> list[Took]:
        """What every run that has ended took."""
        query = sa.select(RUNS.c.owner, RUNS.c.ranks * RUNS.c.threads, RUNS.c.started, RUNS.c.finished)
        ended = query.where(RUNS.c.state.not_in(OPEN), RUNS.c.started > 0.0)
        with self._engine.connect() as connection:
            return [Took(*row) for row in connection.execute(ended)]

    def count_by_state(self) -> Mapping[State, int]:
        """How many runs are in each state; no entry for none."""
        query = sa.select(RUNS.c.state, sa.func.count()).group_by(RUNS.c.state)
        with self._engine.connect() as connection:
            return {State(state): number for state, number in connection.execute(query).all()}

    def run_of_key(self, owner: str, key: str) -> str | None:
        """The run that ``owner`` made with this idempotency key."""
        query = sa.select(KEYS.c.run).where(KEYS.c.owner == owner, KEYS.c.key == key)
        with self._engine.connect() as connection:
            return connection.execute(query).scalar_one_or_none()

    # Tokens -----------------------------------------------------------------------------------------------------------

    def add_token(self, token: Token) -> None:
        """A new token."""
        values = {**asdict(token), "scopes": " ".join(sorted(token.scopes)), "revoked": False}
        with self._engine.begin() as connection:
            connection.execute(sa.insert(TOKENS).values(values))

    def token(self, token_id: str) -> Token | None:
        """The token, unless it was revoked."""
        query = sa.select(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked.is_(False))
        with self._engine.connect() as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else _token(row)

    def tokens(self) -> list[Token]:
        """Every token that is not revoked, oldest first."""
        query = sa.select(TOKENS).where(TOKENS.c.revoked.is_(False)).order_by(TOKENS.c.created, TOKENS.c.id)
        with self._engine.connect() as connection:
            return [_token(row) for row in connection.execute(query).mappings()]

    def revoke(self, token_id: str) -> bool:
        """Ends a token for good; False when there is none to end."""
        query = sa.update(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked.is_(False)).values(revoked=True)
        with self._engine.begin() as connection:
            return connection.execute(query).rowcount == 1


def _complete(engine: sa.Engine) -> None:
    """Adds the columns of runs that the table of an earlier server lacks; those that it has had get their default."""
    there = {column["name"] for column in sa.inspect(engine).get_columns(RUNS.name)}
    with engine.begin() as connection:
        for column in (each for each in RUNS.columns if each.name not in there):
            made = sa.schema.CreateColumn(column).compile(dialect=engine.dialect)
            connection.exec_driver_sql(f"alter table {RUNS.name} add column {made}")


def _parts(items: Sequence[str]) -> Iterator[Sequence[str]]:
    """As many at a time as fit into one statement."""
    return (items[n : n + _AT_ONCE] for n in range(0, len(items), _AT_ONCE))


def _run(row: sa.RowMapping) -> Run:
    values: dict[str, Any] = dict(row)
    values["state"] = State(row["state"])
    for name in ("cause", "stopping_for"):
        values[name] = Cause(row[name]) if row[name] else None
    return Run(**values)


def _token(row: sa.RowMapping) -> Token:
    return Token(row["id"], row["owner"], row["sha256"], frozenset(row["scopes"].split()), row["created"])
