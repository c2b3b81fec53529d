"""The SQLAlchemy engine of the server's database: opening it, its file, and its error messages."""

import os
import shutil
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from ..settings import StartError

_BUSY = 2000
"""Time in ms for which SQLite waits for a lock of another process (chosen value). The time is longer than any
transaction of this server takes, and shorter than the time limit of a request."""
_TABLES = 1 << 16
"""Number of bytes of free disk space below which SQLite cannot open a database, because it needs space for its log and
its shared memory. Measured: 32 KiB."""


class StoreError(StartError):
    """Error: the database cannot be used. The text of this error is one line."""


def failure(url: str | sa.URL, error: Exception, deed: str = "used") -> StoreError:
    """Returns the error for a database that cannot be used. The text of the error names the file, or the address
    without the password, and the cause. ``deed``: what could not be done, such as "opened".
    """
    try:
        made = sa.make_url(url)
        sqlite = made.get_backend_name() == "sqlite" and made.database
        place = made.database if sqlite else made.render_as_string(hide_password=True)
    except sa.exc.ArgumentError:
        sqlite, place = None, repr(url)
    full = " (its disk is full)" if sqlite and _full(Path(sqlite).parent) else ""
    raised = StoreError(f"the database cannot be {deed}: {place}: {str(error).splitlines()[0]}{full}")
    raised.exit_code = 2 if isinstance(error, sa.exc.ArgumentError) else 1
    return raised


def _full(folder: Path) -> bool:
    try:
        return shutil.disk_usage(folder).free < _TABLES
    except OSError:
        return False


def engine_of(url: str | sa.URL) -> sa.Engine:
    """Opens the database. Raises SQLAlchemyError; raises ImportError if the driver of the database is not installed."""
    made = sa.make_url(url)
    engine = sa.create_engine(made, pool_pre_ping=made.get_backend_name() != "sqlite")
    if engine.dialect.name == "sqlite":
        sa.event.listen(engine, "connect", _tune)
    return engine


def _tune(connection: Any, _record: object) -> None:
    """Switches SQLite to write-ahead logging, so that readers do not wait for a writer."""
    for pragma in ("journal_mode=wal", f"busy_timeout={_BUSY}"):
        connection.execute(f"pragma {pragma}").close()
    connection.create_function("lower", 1, _lower, deterministic=True)


def _lower(text: str | None) -> str | None:
    """Converts all letters of a text to lower case; SQLite itself converts only ASCII letters."""
    return text if text is None else str(text).lower()


def identity_of(engine: sa.Engine) -> tuple[int, int] | None:
    """Returns the device and the inode of the file of an SQLite database; returns None for other databases or a missing
    file.
    """
    place = engine.url.database if engine.dialect.name == "sqlite" else None
    try:
        status = os.stat(place) if place else None
    except OSError:
        return None
    return (status.st_dev, status.st_ino) if status else None
