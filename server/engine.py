"""The engine of the server's database: how it is opened, which file it is, and what is told when it fails."""

import os
import shutil
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from .settings import StartError

_BUSY = 2000
"""ms that SQLite waits for another process to let go. Chosen: longer than any transaction of this server takes, shorter
than what a caller waits for."""
_TABLES = 1 << 16
"""Bytes without which SQLite opens no database: its log and what it shares with others. By hand: 32 KiB."""


class StoreError(StartError):
    """The database cannot be used; the text is one line."""


def failure(url: str | sa.URL, error: Exception, deed: str = "used") -> StoreError:
    """What is told of a database: its file, or its address without the password, and why it cannot be ``deed``."""
    try:
        made = sa.make_url(url)
        sqlite = made.get_backend_name() == "sqlite" and made.database
        place = made.database if sqlite else made.render_as_string(hide_password=True)
    except sa.exc.ArgumentError:
        sqlite, place = None, repr(url)
    full = " (its disk is full)" if sqlite and _full(Path(sqlite).parent) else ""
    told = StoreError(f"the database cannot be {deed}: {place}: {str(error).splitlines()[0]}{full}")
    told.exit_code = 2 if isinstance(error, sa.exc.ArgumentError) else 1
    return told


def _full(folder: Path) -> bool:
    try:
        return shutil.disk_usage(folder).free < _TABLES
    except OSError:
        return False


def engine_of(url: str | sa.URL) -> sa.Engine:
    """Raises SQLAlchemyError, ImportError where the driver is not installed."""
    made = sa.make_url(url)
    engine = sa.create_engine(made, pool_pre_ping=made.get_backend_name() != "sqlite")
    if engine.dialect.name == "sqlite":
        sa.event.listen(engine, "connect", _tune)
    return engine


def _tune(connection: Any, _record: object) -> None:
    """WAL lets readers go on while one writes."""
    for pragma in ("journal_mode=wal", f"busy_timeout={_BUSY}"):
        connection.execute(f"pragma {pragma}").close()


def identity_of(engine: sa.Engine) -> tuple[int, int] | None:
    """Device and number of the file of an SQLite database; None where there is none, as for other databases."""
    place = engine.url.database if engine.dialect.name == "sqlite" else None
    try:
        status = os.stat(place) if place else None
    except OSError:
        return None
    return (status.st_dev, status.st_ino) if status else None
