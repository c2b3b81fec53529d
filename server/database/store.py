"""The server's tables: runs, labels, idempotency keys, tokens.

The database is SQLite by default, or PostgreSQL by URL. Runs, labels and idempotency keys can be made again from the
folders of the runs; tokens are stored in the database only.
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
"""Key of the single row in the table that binds the database to a server."""
_AT_ONCE = 500
"""Largest number of ids in one SQL statement; older versions of SQLite allow 999 (reason of the chosen value)."""


@dataclass(frozen=True)
class Token:
    """A stored token. The database stores the hash of the secret, never the secret."""

    id: str
    owner: str
    sha256: str
    scopes: frozenset[str]
    created: float
    """Time at which the token was made, Unix s."""


class Bond(msgspec.Struct, frozen=True):
    """The server to which the database belongs: its identity, and the path ``place`` of its folder of runs."""

    server: str
    place: str


@dataclass(frozen=True)
class KeptCard:
    """A stored card of a run (card.py). ``final``: whether the card was made after the end of the run."""

    run: str
    form: int
    final: bool
    body: bytes


class Store:
    """The database of a server. All methods of this class may be called from any thread. Each method is one
    transaction, and raises SQLAlchemyError on failure.
    """

    def __init__(self, url: str | sa.URL) -> None:
        """Opens the database and creates missing tables. Raises StoreError if the database cannot be opened."""
        try:
            self._engine = engine_of(url)
            self.unlabelled = not sa.inspect(self._engine).has_table(LABELS.name)
            """True if the database is new or from an older version, so that the labels must be read from the folders of
            the runs."""
            META.create_all(self._engine)
            _complete(self._engine)
            self._file = identity_of(self._engine)
        except (SQLAlchemyError, ImportError) as error:
            raise failure(url, error, "opened") from None

    def close(self) -> None:
        """Closes every connection to the database."""
        self._engine.dispose()

    def probe(self) -> None:
        """Raises SQLAlchemyError if the database cannot be written, or if its file was removed."""
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
        """Returns the server to which the database belongs; None for a new database."""
        with self._engine.connect() as connection:
            row = connection.execute(sa.select(BONDS.c.server, BONDS.c.place)).first()
        return None if row is None else Bond(row[0], row[1])

    def bind(self, bond: "Bond") -> None:
        """Stores the server to which a new database belongs. If the database already belongs to a server, nothing is
        changed.
        """
        with suppress(sa.exc.IntegrityError), self._engine.begin() as connection:
            connection.execute(sa.insert(BONDS).values(number=_ONLY, server=bond.server, place=bond.place))

    def rebind(self, bond: "Bond") -> None:
        """Replaces the server to which the database belongs."""
        with self._engine.begin() as connection:
            connection.execute(sa.delete(BONDS))
            connection.execute(sa.insert(BONDS).values(number=_ONLY, server=bond.server, place=bond.place))

    # Runs -------------------------------------------------------------------------------------------------------------

    def add(self, run: Run, key: str | None, labels: Mapping[str, str] | None = None) -> None:
        """Adds a run, its labels, and its idempotency key. If the run exists, changes its state and labels."""
        known = sa.select(KEYS.c.run).where(KEYS.c.owner == run.owner, KEYS.c.key == key)
        with self._engine.begin() as connection:
            self._put(connection, run)
            if key is not None and connection.execute(known).first() is None:
                connection.execute(sa.insert(KEYS).values(owner=run.owner, key=key, run=run.id))
            self._label(connection, run, labels or {})

    def relabel(self, run: Run, labels: Mapping[str, str]) -> None:
        """Replaces the labels of a run."""
        with self._engine.begin() as connection:
            self._label(connection, run, labels)

    @staticmethod
    def _label(connection: sa.Connection, run: Run, labels: Mapping[str, str]) -> None:
        connection.execute(sa.delete(LABELS).where(LABELS.c.run == run.id))
        if labels:
            rows = [{"run": run.id, "name": name, "owner": run.owner, "value": labels[name]} for name in labels]
            connection.execute(sa.insert(LABELS), rows)

    def labels(self, run_ids: Sequence[str]) -> dict[str, dict[str, str]]:
        """Returns the labels of runs by id."""
        found: dict[str, dict[str, str]] = {run_id: {} for run_id in run_ids}
        with self._engine.connect() as connection:
            for some in _parts(run_ids):
                rows = connection.execute(sa.select(LABELS).where(LABELS.c.run.in_(some)))
                for run_id, name, _, value in rows:
                    found[run_id][name] = value
        return found

    def save(self, run: Run) -> None:
        """Updates the row of a run."""
        with self._engine.begin() as connection:
            self._put(connection, run)

    @staticmethod
    def _put(connection: sa.Connection, run: Run) -> None:
        values = {name: str(value) if isinstance(value, StrEnum) else value for name, value in asdict(run).items()}
        if connection.execute(sa.update(RUNS).where(RUNS.c.id == run.id).values(values)).rowcount == 0:
            connection.execute(sa.insert(RUNS).values(values))

    def all(self) -> list[Run]:
        """Returns all runs of all owners."""
        with self._engine.connect() as connection:
            return [_run(row) for row in connection.execute(sa.select(RUNS)).mappings()]

    def get(self, run_id: str) -> Run | None:
        """Returns a run by its id, for any owner."""
        with self._engine.connect() as connection:
            row = connection.execute(sa.select(RUNS).where(RUNS.c.id == run_id)).mappings().first()
        return None if row is None else _run(row)

    def some(self, run_ids: Sequence[str]) -> dict[str, Run]:
        """Returns the runs with the given ids by id, of any owner; unknown ids are left out."""
        with self._engine.connect() as connection:
            rows = (connection.execute(sa.select(RUNS).where(RUNS.c.id.in_(some))) for some in _parts(run_ids))
            return {row["id"]: _run(row) for found in rows for row in found.mappings()}

    def page(self, owner: str, chosen: Chosen, before: str | None, limit: int) -> list[Run]:
        """Returns the newest runs of ``owner`` that match the filters ``chosen``, at most ``limit``, newest first.
        ``before``: id; only runs with smaller ids are returned.
        """
        query = sa.select(RUNS).where(*chosen.where(owner)).order_by(RUNS.c.id.desc()).limit(limit)
        if before is not None:
            query = query.where(RUNS.c.id < before)
        with self._engine.connect() as connection:
            return [_run(row) for row in connection.execute(query).mappings()]

    def ids_about(self, owner: str, first: str, last: str) -> list[str]:
        """Returns the sorted ids of the runs of ``owner`` from ``first`` to ``last``, and the ids directly before and
        after this range.
        """
        own = sa.select(RUNS.c.id).where(RUNS.c.owner == owner)
        before = own.where(RUNS.c.id < first).order_by(RUNS.c.id.desc()).limit(1)
        after = own.where(RUNS.c.id > last).order_by(RUNS.c.id).limit(1)
        within = own.where(RUNS.c.id.between(first, last)).order_by(RUNS.c.id)
        with self._engine.connect() as connection:
            return [run_id for query in (before, within, after) for (run_id,) in connection.execute(query)]

    def cards(self, run_ids: Sequence[str]) -> list[KeptCard]:
        """Returns the stored cards of the given runs."""
        with self._engine.connect() as connection:
            found = (connection.execute(sa.select(CARDS).where(CARDS.c.run.in_(some))) for some in _parts(run_ids))
            return [KeptCard(*row) for rows in found for row in rows]

    def keep_cards(self, cards: Sequence[KeptCard], titles: Mapping[str, str]) -> None:
        """Stores cards; replaces earlier cards. ``titles``: titles of cases that an older server did not store."""
        with self._engine.begin() as connection:
            for card in cards:
                connection.execute(sa.delete(CARDS).where(CARDS.c.run == card.run))
                connection.execute(sa.insert(CARDS).values(asdict(card)))
            for run_id, title in titles.items():
                untitled = sa.update(RUNS).where(RUNS.c.id == run_id, RUNS.c.title == "")
                connection.execute(untitled.values(title=title))

    def open_runs(self, owner: str) -> int:
        """Returns the number of open runs of ``owner``."""
        query = sa.select(sa.func.count()).select_from(RUNS).where(RUNS.c.owner == owner, RUNS.c.state.in_(OPEN))
        with self._engine.connect() as connection:
            return connection.execute(query).scalar_one()

    def ended(self) -> dict[str, State]:
        """Returns the state of all runs that have ended, by id."""
        query = sa.select(RUNS.c.id, RUNS.c.state).where(RUNS.c.state.not_in(OPEN))
        with self._engine.connect() as connection:
            return {run_id: State(state) for run_id, state in connection.execute(query)}

    def open(self) -> dict[str, Run]:
        """Returns all open runs by id."""
        query = sa.select(RUNS).where(RUNS.c.state.in_(OPEN))
        with self._engine.connect() as connection:
            return {row["id"]: _run(row) for row in connection.execute(query).mappings()}

    def taken(self) -> list[Took]:
        """Returns the use of cores by every run that has ended: number of cores, start and end."""
        query = sa.select(RUNS.c.owner, RUNS.c.ranks * RUNS.c.threads, RUNS.c.started, RUNS.c.finished)
        ended = query.where(RUNS.c.state.not_in(OPEN), RUNS.c.started > 0.0)
        with self._engine.connect() as connection:
            return [Took(*row) for row in connection.execute(ended)]

    def count_by_state(self) -> Mapping[State, int]:
        """Returns the number of runs in each state; states without runs are missing."""
        query = sa.select(RUNS.c.state, sa.func.count()).group_by(RUNS.c.state)
        with self._engine.connect() as connection:
            return {State(state): number for state, number in connection.execute(query).all()}

    def run_of_key(self, owner: str, key: str) -> str | None:
        """Returns the id of the run that ``owner`` has submitted with this idempotency key; None if there is none."""
        query = sa.select(KEYS.c.run).where(KEYS.c.owner == owner, KEYS.c.key == key)
        with self._engine.connect() as connection:
            return connection.execute(query).scalar_one_or_none()

    # Tokens -----------------------------------------------------------------------------------------------------------

    def add_token(self, token: Token) -> None:
        """Adds a token."""
        values = {**asdict(token), "scopes": " ".join(sorted(token.scopes)), "revoked": False}
        with self._engine.begin() as connection:
            connection.execute(sa.insert(TOKENS).values(values))

    def token(self, token_id: str) -> Token | None:
        """Returns a token by its hash; None if the token is unknown or revoked."""
        query = sa.select(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked.is_(False))
        with self._engine.connect() as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else _token(row)

    def tokens(self) -> list[Token]:
        """Returns every token that is not revoked, oldest first."""
        query = sa.select(TOKENS).where(TOKENS.c.revoked.is_(False)).order_by(TOKENS.c.created, TOKENS.c.id)
        with self._engine.connect() as connection:
            return [_token(row) for row in connection.execute(query).mappings()]

    def revoke(self, token_id: str) -> bool:
        """Revokes a token. Returns False if there is no such token."""
        query = sa.update(TOKENS).where(TOKENS.c.id == token_id, TOKENS.c.revoked.is_(False)).values(revoked=True)
        with self._engine.begin() as connection:
            return connection.execute(query).rowcount == 1


def _complete(engine: sa.Engine) -> None:
    """Adds the columns that the table of an older server lacks, with their default values."""
    there = {column["name"] for column in sa.inspect(engine).get_columns(RUNS.name)}
    with engine.begin() as connection:
        for column in (each for each in RUNS.columns if each.name not in there):
            made = sa.schema.CreateColumn(column).compile(dialect=engine.dialect)
            connection.exec_driver_sql(f"alter table {RUNS.name} add column {made}")


def _parts(items: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yields the ids in groups of the largest number for one SQL statement."""
    return (items[n : n + _AT_ONCE] for n in range(0, len(items), _AT_ONCE))


def _run(row: sa.RowMapping) -> Run:
    values: dict[str, Any] = dict(row)
    values["state"] = State(row["state"])
    for name in ("cause", "stopping_for"):
        values[name] = Cause(row[name]) if row[name] else None
    return Run(**values)


def _token(row: sa.RowMapping) -> Token:
    return Token(row["id"], row["owner"], row["sha256"], frozenset(row["scopes"].split()), row["created"])
