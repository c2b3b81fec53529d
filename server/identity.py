"""Whose runs these are: one server has one folder of runs and one database, and each says which other it belongs to.

A second server on the same database would take the runs of the first one for lost, and a copy of a folder would end
the workers of the original: both are refused. ``adopt`` says that folder and database belong together here, for a
folder that has been moved, or restored from a backup.
"""

import secrets
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases import whole

from . import durable
from .settings import SettingsError
from .store import Bond, Store

FILE = "server.identity"
_MOST = 1 << 16
"""Bytes of the file that are read. Chosen: it has some hundred."""


class IdentityError(SettingsError):
    """Folder and database do not belong together, or not here; the text is one line."""


@dataclass(frozen=True)
class Pair:
    """What the folder and the database say, each None where it says nothing yet."""

    place: str
    folder: Bond | None
    database: Bond | None


def require(runs: Path, store: Store) -> None:
    """Binds a folder and a database that are new to each other. Raises IdentityError where they are no pair, OSError,
    SQLAlchemyError.
    """
    found = _look(runs, store)
    if why := _wrong(found):
        remedy = f"if it is no longer served there: python -m conoid.server --runs {runs} adopt"
        raise IdentityError(f"--runs {runs}: {why}; {remedy}")
    known = found.folder or found.database or Bond(secrets.token_hex(16), found.place)
    _bind(runs, store, found, known)
    if store.bond() != known:
        raise IdentityError(f"--runs {runs}: another server begins to use this database")


def adopt(runs: Path, store: Store) -> str:
    """Folder and database belong together here from now on; what they belonged to before, in one line.

    Raises OSError, SQLAlchemyError.
    """
    try:
        found = _look(runs, store)
    except IdentityError:
        found = Pair(str(runs.resolve()), None, store.bond())
    made = Bond((found.folder or found.database or Bond(secrets.token_hex(16), "")).server, found.place)
    store.rebind(made)
    durable.write(runs / FILE, _text(made))
    before = {bond.place for bond in (found.folder, found.database) if bond is not None} - {found.place}
    return f"belonged to {' and '.join(sorted(before))} before" if before else "belonged here before"


def _look(runs: Path, store: Store) -> Pair:
    """Raises IdentityError where the folder's file says nothing that can be read."""
    place = str(runs.resolve())
    try:
        folder = msgspec.json.decode(whole.read(runs / FILE, _MOST), type=Bond)
    except FileNotFoundError:
        folder = None
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise IdentityError(
            f"--runs {runs}: {FILE} cannot be read ({error}); python -m conoid.server --runs {runs} adopt makes it anew"
        ) from None
    return Pair(place, folder, store.bond())


def _wrong(found: Pair) -> str:
    """Why the two are no pair; empty when they are, or can become one."""
    if found.folder is not None and found.folder.place != found.place:
        return f"this folder is a copy of {found.folder.place}, or was moved from there"
    if found.database is None:
        return ""
    if found.folder is None or found.database.server != found.folder.server:
        return f"its database belongs to the folder {found.database.place}"
    return ""


def _bind(runs: Path, store: Store, found: Pair, known: Bond) -> None:
    if found.database is None:
        store.bind(known)
    if found.folder is None:
        durable.write(runs / FILE, _text(known))


def _text(bond: Bond) -> bytes:
    return msgspec.json.format(msgspec.json.encode(bond), indent=2) + b"\n"
