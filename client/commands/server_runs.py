"""Commands for runs on a server: submit, list, show, follow, cancel, request, copy files."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from conoid.cases.output import layout
from conoid.cases.run import ExitCode

from ..errors import ClientError, UnfinishedError, UsageError
from ..live import Live, exit_code
from ..local import local_run
from ..local.folders import LocalFolder
from ..local.following import FolderRun
from ..remote.run_info import FileInfo, RunInfo
from ..remote.session import connect
from ..run import Run
from ..watch import watch
from . import tables
from .batch import cancel_folder, slurm_of
from .console import echo, echo_json
from .options import (
    CaseArgument,
    Json,
    Labels,
    MaxSteps,
    Overrides,
    Ranks,
    SourceArgument,
    Threads,
    Token,
    Url,
    aloud,
    complain,
    find,
    folder_of,
    labels_of,
    named,
    on_cores,
    show,
    warn_of,
)


def _filled(key: str | None) -> str | None:
    """Returns the idempotency key. Raises UsageError if the key is empty, as from an unset variable: an empty key
    would allow a second run.
    """
    if key is not None and not key.strip():
        raise UsageError("--key is empty: write a key, or leave the option out")
    return key


RunArgument = Annotated[
    str, typer.Argument(metavar="RUN", callback=named, help="The id of a run, the beginning of an id, or 'last'.")
]


def submit(
    case: CaseArgument,
    overrides: Overrides = None,
    key: Annotated[
        str | None,
        typer.Option(
            "--key", callback=_filled, help="Idempotency key: a second call with the same key makes no second run."
        ),
    ] = None,
    ranks: Ranks = None,
    threads: Threads = None,
    label: Labels = None,
    profile: Annotated[
        str, typer.Option("--profile", help="Profile of the batch system; default: the site's default profile.")
    ] = "",
    priority: Annotated[int, typer.Option("--priority", help="Priority among your own runs: -100 to 100.")] = 0,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Submit a case to the server, and print the id of the run."""
    changes = [*(overrides or ()), *on_cores(ranks, threads)]
    warn_of(case, changes)
    with connect(url, token) as session:
        with aloud("submitting the case") as session.outbox.say:
            run = session.submit(case, changes, key, labels_of(label), profile, priority)
        if as_json:
            echo_json(run.status())
        else:
            echo(run.id)


def restart(
    run: RunArgument,
    ranks: Ranks = None,
    threads: Threads = None,
    max_steps: MaxSteps = None,
    url: Url = None,
    token: Token = None,
    as_json: Json = False,
) -> None:
    """Continue from the newest checkpoint of a run as a new run with the same answer, and print the id of the new
    run.
    """
    with connect(url, token) as session:
        made = session.restart(find(session, run).id, ranks, threads=threads, max_steps=max_steps)
        if as_json:
            echo_json(made.status())
        else:
            echo(made.id)


def show_run(run: SourceArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Show the progress or the outcome of one run."""
    if (folder := folder_of(run)) is not None:
        info = local_run.status(folder)
    else:
        with connect(url, token) as session:
            info = find(session, run).status()
    if as_json:
        echo_json(info)
        return
    show(tables.run_table(info))
    if info.outcome is not None:
        show("")
        for part in tables.end_tables(info.outcome):
            show(part)


def watch_run(
    run: SourceArgument,
    plain: Annotated[bool, typer.Option("--plain", help="Print text lines instead of the panel.")] = False,
    url: Url = None,
    token: Token = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print every message as one line of JSON.")] = False,
) -> None:
    """Follow a run until it ends. Exit codes: 0 succeeded, 1 failed, 2 bad input, 4 cancelled. Ctrl-C ends the
    command; the run continues.
    """
    if (folder := folder_of(run)) is not None:
        LocalFolder(folder).path(layout.JOURNAL)
        followed = FolderRun(folder, slurm_of(None).bin)
        known = _print_messages(followed) if as_json else watch(followed, False if plain else None)
        if not as_json:
            _tell_probes(lambda: local_run.status(folder))
    else:
        known = _watched(run, plain, url, token, as_json)
    if not as_json and (known.message or known.cause):
        complain(f"{known.run} {known.state.value}: {known.message or known.cause}")
    raise typer.Exit(exit_code(known.state, known.cause))


def _watched(run: str, plain: bool, url: str | None, token: str | None, as_json: bool) -> Live:
    with connect(url, token) as session:
        found = find(session, run)
        try:
            known = _print_messages(found) if as_json else watch(found, False if plain else None)
            if not known.state.final:  # The journal has no record of the end of the run.
                info = found.status()
                known.state, known.cause, known.message = info.state, info.cause, info.message
            if not as_json:
                _tell_probes(found.status)
            return known
        except KeyboardInterrupt:
            complain(f"the run continues; conoid watch {found.id} shows the run again")
            raise


def _tell_probes(status: Callable[[], RunInfo]) -> None:
    """Prints the probes of a run if the server sends them."""
    with suppress(ClientError):
        ended = status().outcome
        if ended is not None and ended.probes:
            show(tables.probes_table(ended.probes))


def _print_messages(run: Run | FolderRun) -> Live:
    known = Live(run.id)
    for message in run.messages():
        known.take(message)
        echo_json(message, indent=False)
        sys.stdout.flush()
    return known


def _tell(info: RunInfo, text: str, as_json: bool) -> None:
    if as_json:
        echo_json(info)
    else:
        echo(text)


def _ask(
    run: str, here: Callable[[Path], str], there: Callable[[Run], RunInfo], done: str, url: Url, token: Token,
    as_json: Json,
) -> None:  # fmt: skip
    """Acts on a run: ``here`` is called if a worker runs in the folder ``run``, else ``there`` with the run of the
    server. Prints one line; ``done``: what was requested, empty if the state of the run is printed.
    """
    if (folder := folder_of(run)) is not None and local_run.at_hand(folder):
        echo(here(folder))
        return
    with connect(url, token) as session:
        info = there(find(session, run))
    _tell(info, f"{info.id} {done or info.state.value}", as_json)


def cancel(run: SourceArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Stop a run at its next step; name a run without a server by its folder."""
    _ask(run, cancel_folder, Run.cancel, "", url, token, as_json)


def checkpoint(run: SourceArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Request a checkpoint of a run, from which the run can continue if it is lost."""
    here = partial(local_run.ask, request=layout.CHECKPOINT_REQUEST, wish="checkpoint")
    _ask(run, here, Run.checkpoint, "checkpoint requested", url, token, as_json)


def snapshot(run: SourceArgument, url: Url = None, token: Token = None, as_json: Json = False) -> None:
    """Request a snapshot of the fragments of a run; conoid watch reports the snapshot when it is complete."""
    here = partial(local_run.ask, request=layout.SNAPSHOT_REQUEST, wish="snapshot")
    _ask(run, here, Run.take_snapshot, "snapshot requested", url, token, as_json)


def get(
    run: SourceArgument,
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FILE]...", help="Files to copy; default: all except checkpoints."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Target folder; default: the run's id.")] = None,
    url: Url = None,
    token: Token = None,
    as_json: Annotated[bool, typer.Option("--json", help="List the run's files as JSON; copies nothing.")] = False,
) -> None:
    """Copy files of a run to this machine. If files are missing, the command lists the missing files and ends with
    exit code 1.
    """
    if (folder := folder_of(run)) is not None and local_run.at_hand(folder):
        _copy(local_run.FolderFiles(folder), names, out, as_json)
        return
    with connect(url, token) as session:
        _copy(find(session, run), names, out, as_json)


def _copy(found: Run | local_run.FolderFiles, names: list[str] | None, out: Path | None, as_json: bool) -> None:
    if as_json:
        echo_json(found.files())
        return
    target = out or Path(found.id)
    final = found.over()
    listed = {file.path: file for file in found.files()}
    lacks = False
    for name in names or [path for path in listed if not path.startswith(f"{layout.CHECKPOINTS}/")]:
        try:
            with aloud(f"fetching {name}"):
                fetched = found.fetch(target, listed.get(name, FileInfo(path=name)), final)
        except UnfinishedError as error:
            complain(str(error))
            lacks = True
        else:
            echo(fetched)
    if lacks:
        raise typer.Exit(ExitCode.CRASHED)
