"""The identity of a server, which is stored both in its folder of runs and in its database.

A server refuses to start if its folder and its database belong to different servers. Without this check a second server
with the same database would mark the runs of the first server as lost, and a server with a copy of a folder would stop
the workers of the original folder. The command ``adopt`` binds a folder and a database that were moved, or restored
from a backup.
"""

import secrets
from dataclasses import dataclass
from pathlib import Path

import msgspec

from conoid.cases.reading import whole

from .. import durable
from ..settings import SettingsError
from .store import Bond, Store

FILE = "server.identity"
_MOST = 1 << 16
"""Largest number of bytes that are read from the identity file, which has some hundred bytes (reason of the chosen
value)."""


class IdentityError(SettingsError):
    """Error: folder and database do not belong together, or were moved from another place. The text of this error is
    one line.
    """


@dataclass(frozen=True)
class Pair:
    """The identities that the folder and the database have stored; None if nothing is stored yet."""

    place: str
    folder: Bond | None
    database: Bond | None


def require(runs: Path, store: Store) -> None:
    """Binds a new folder of runs and a new database to each other. Raises IdentityError if folder and database do not
    belong together; raises OSError or SQLAlchemyError.
    """
    found = _look(runs, store)
    if why := _wrong(found):
        remedy = f"if no server uses the database there any more: python -m conoid.server --runs {runs} adopt"
        raise IdentityError(f"--runs {runs}: {why}; {remedy}")
    known = found.folder or found.database or Bond(secrets.token_hex(16), found.place)
    _bind(runs, store, found, known)
    if store.bond() != known:
        raise IdentityError(f"--runs {runs}: another server begins to use this database")


def adopt(runs: Path, store: Store) -> str:
    """Binds folder and database to each other at their present place. Returns the previous identities of folder and
    database as one line of text. Raises OSError or SQLAlchemyError.
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
    """Returns the identities that the folder of runs and the database have stored. Raises IdentityError if the identity
    file cannot be read.
    """
    place = str(runs.resolve())
    try:
        folder = msgspec.json.decode(whole.read(runs / FILE, _MOST), type=Bond)
    except FileNotFoundError:
        folder = None
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise IdentityError(
            f"--runs {runs}: {FILE} cannot be read ({error}); python -m conoid.server --runs {runs} adopt rewrites it"
        ) from None
    return Pair(place, folder, store.bond())


def _wrong(found: Pair) -> str:
    """Returns why the folder and the database cannot be used together; empty if they can."""
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
