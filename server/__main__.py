"""``python -m conoid.server``: runs the server. ``token add | list | revoke`` manages the access to the server.
``adopt`` registers a folder of runs that was moved or restored from a backup.
"""

import argparse
import logging
import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from sqlalchemy.exc import SQLAlchemyError

from .alone import only_one
from .database import identity
from .database.engine import failure
from .database.store import Store
from .requests.tokens import SCOPES, TokenError, create_token
from .settings import Caps, Settings, SettingsError, StartError, capped, command, site_of


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code: 0 for success, 2 for a wrong command line, 1 for any other
    failure. A failure prints one line of text.
    """
    options = _parser().parse_args(arguments)
    logging.basicConfig(format="%(asctime)s %(levelname)s %(message)s", level=logging.INFO)
    try:
        act: Callable[[argparse.Namespace], None] = options.act
        act(options)
    except StartError as error:
        print(f"conoid.server: {error}", file=sys.stderr)
        return error.exit_code
    except OSError as error:
        place = "" if error.filename is None else f"{error.filename}: "
        print(f"conoid.server: {place}{error.strerror or error}", file=sys.stderr)
        return 1
    except SQLAlchemyError as error:
        print(f"conoid.server: {failure(_settings(options).database_url, error)}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("conoid serve", description="The job server.", allow_abbrev=False)
    parser.set_defaults(act=_serve)
    _common(parser)
    add = parser.add_argument
    add("--host", default="127.0.0.1", help="address to listen on (default: this machine only)")
    add("--port", type=int, default=8750, help="0: any free port (default 8750)")
    add("--zenoh-port", type=int, default=7447, help="port of the Zenoh router; 0: any free port (default 7447)")
    add("--no-zenoh", action="store_true", help="no Zenoh router; clients watch over SSE")
    add(
        "--slots",
        type=int,
        help="cores that runs may take at a time (default: the cores of this machine, or the site's)",
    )
    site = os.environ.get("CONOID_SITE")
    add("--site", type=Path, default=site, help="the site's settings file: Slurm and its profiles [CONOID_SITE]")
    add("--no-auth", action="store_true", help="no tokens; only on a loopback address")
    add("--web", type=Path, help="folder of the live page, served at /")
    add("--mpiexec", default=os.environ.get("CONOID_MPIEXEC", ""), help="the site's own launcher [CONOID_MPIEXEC]")
    add("--worker", default=os.environ.get("CONOID_WORKER"), help="command of the worker [CONOID_WORKER]")
    add("--grace", type=float, default=30.0, help="seconds between the request to stop and the kill (default 30)")
    add("--end-runs", action="store_true", help="cancel all runs when the server stops (default: workers continue)")
    for name, kind, text in _CAPS:
        add(f"--max-{name.replace('_', '-')}", type=kind, help=text)
    _token_commands(parser)
    return parser


_CAPS: tuple[tuple[str, Callable[[str], float], str], ...] = (
    ("elements", int, "largest number of elements of a case"),
    ("steps", int, "largest number of steps of a case"),
    ("memory", int, "largest memory of a case, bytes (default: what the machine has)"),
    ("core_seconds", float, "largest expected cost of a case, s"),
    ("wall_time", float, "longest run, s"),
    ("queued", int, "open runs of one owner (default 1000)"),
    ("output_bytes", int, "largest folder of a run, bytes"),
)


def _common(parser: argparse.ArgumentParser) -> None:
    runs = os.environ.get("CONOID_RUNS", "runs")
    parser.add_argument("--runs", type=Path, default=Path(runs), help="folder of all runs [CONOID_RUNS] (%(default)s)")
    parser.set_defaults(database=os.environ.get("CONOID_DATABASE", ""))


def _token_commands(parser: argparse.ArgumentParser) -> None:
    first = parser.add_subparsers(metavar="token|adopt")
    adopt = first.add_parser("adopt", help="a folder that was moved or restored belongs to its database, here")
    adopt.add_argument("--runs", type=Path, default=argparse.SUPPRESS, help="folder of the server's runs")
    adopt.set_defaults(act=_adopt)
    token = first.add_parser("token", help="users who may use the server")
    commands = token.add_subparsers(required=True, metavar="add|list|revoke")
    add = commands.add_parser("add", help="make a token and print it, once")
    add.add_argument("name", help="whose runs it is for")
    scopes = "; ".join(f"{name}: {text}" for name, text in SCOPES.items())
    add.add_argument("--scopes", default="read,submit", help=f"with commas between (default read,submit). {scopes}")
    add.set_defaults(act=_add)
    listing = commands.add_parser("list", help="the tokens that are valid")
    listing.set_defaults(act=_list)
    revoke = commands.add_parser("revoke", help="end a token for good")
    revoke.add_argument("id", help="as 'token list' shows it")
    revoke.set_defaults(act=_revoke)
    for one in (add, listing, revoke):
        one.add_argument("--runs", type=Path, default=argparse.SUPPRESS, help="folder of the server's runs")


def _settings(options: argparse.Namespace) -> Settings:
    site = site_of(options.site)
    caps = {name: value for name, _, _ in _CAPS if (value := getattr(options, f"max_{name}")) is not None}
    for name, value in caps.items():
        if not 0 < value < float("inf"):
            raise SettingsError(f"--max-{name.replace('_', '-')} {value}: above 0, finite")
    given: dict[str, Any] = {**capped(site), **caps}
    chosen = {"slots": options.slots} if options.slots is not None else {}
    if site.launcher == "slurm" and site.slurm is not None:
        chosen.setdefault("slots", site.slurm.slots)
        given.setdefault("memory", None)
    if options.worker:
        chosen["worker"] = command(options.worker)
    return Settings(
        runs=options.runs.resolve(),
        host=options.host,
        port=options.port,
        zenoh_port=None if options.no_zenoh else options.zenoh_port,
        auth=not options.no_auth,
        web=options.web,
        database=options.database,
        mpiexec=options.mpiexec,
        grace=options.grace,
        end_runs=options.end_runs,
        caps=Caps(**given),
        site=site,
        **chosen,
    )


def _serve(options: argparse.Namespace) -> None:
    from .serve import serve

    settings = _settings(options)
    if settings.site.launcher == "local":
        _check_programs(settings)
    serve(settings)


def _check_programs(settings: Settings) -> None:
    """Raises SettingsError if the launcher or the worker is not a program."""
    launcher = command(settings.mpiexec, "--mpiexec") if settings.mpiexec else ()
    for option, words in (("--mpiexec", launcher), ("--worker", settings.worker)):
        if words and shutil.which(words[0]) is None:
            raise SettingsError(f"{option} {words[0]}: there is no such program")


def _untouched(settings: Settings) -> bool:
    """Whether the folder of runs has no database yet: no server has used it, and no token was added."""
    return not settings.database and not settings.database_file.exists()


def _store(options: argparse.Namespace) -> Store:
    """Returns the database with the tokens. Raises SettingsError if the database does not exist, because ``--runs`` may
    name a wrong folder.
    """
    settings = _settings(options)
    if _untouched(settings):
        raise SettingsError(f"--runs {settings.runs}: no server has used this folder, and it has no tokens")
    os.umask(0o077)
    return Store(settings.database_url)


def _add(options: argparse.Namespace) -> None:
    """Adds a token. If the folder of runs and its database do not exist, creates the folder and the database, and
    prints that the database is new.
    """
    settings = _settings(options)
    new = _untouched(settings)
    os.umask(0o077)
    if not settings.database:
        settings.runs.mkdir(parents=True, exist_ok=True)
    store = Store(settings.database_url)
    print(create_token(store, options.name, frozenset(word.strip() for word in options.scopes.split(","))), flush=True)
    store.close()
    if new:
        note = f"{settings.database_file} is new: the token is valid at a server with this --runs"
        print(f"conoid.server: {note}", file=sys.stderr)


def _adopt(options: argparse.Namespace) -> None:
    """Binds the folder of runs and its database to each other. Raises SettingsError if another server uses the folder
    of runs, or if the folder does not exist.
    """
    settings = _settings(options)
    if not settings.runs.is_dir():
        raise SettingsError(f"--runs {settings.runs}: there is no such folder")
    os.umask(0o077)
    with only_one(settings.runs):
        store = Store(settings.database_url)
        before = identity.adopt(settings.runs, store)
        store.close()
    print(f"{settings.runs} and its database belong together; {before}")


def _list(options: argparse.Namespace) -> None:
    store = _store(options)
    for token in store.tokens():
        made = time.strftime("%Y-%m-%d %H:%M", time.localtime(token.created))
        print(f"{token.id}  {token.owner}  {','.join(sorted(token.scopes))}  {made}")
    store.close()


def _revoke(options: argparse.Namespace) -> None:
    store = _store(options)
    if not store.revoke(options.id):
        raise TokenError(f"token {options.id!r}: there is none; 'token list' shows all")
    store.close()


if __name__ == "__main__":
    sys.exit(main())
