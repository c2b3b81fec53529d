"""The command ``conoid sweep --adaptive``: reads the goal from the arguments and prints the result as lines or JSON."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import typer

from conoid.cases.load import apply_overrides
from conoid.cases.run import ExitCode

from ..errors import UsageError
from ..remote.session import Session
from ..remote.submission import data_of, folder_of, locate
from ..sweeps.adaptive import MOST, found_by
from ..sweeps.adaptive_result import Found
from ..sweeps.goal import spans_of
from .console import echo, echo_json
from .options import aloud, complain


def file_of(case: str, goal: str, sets: Sequence[str]) -> Path:
    """Returns the default file of an adaptive sweep; equal arguments of the command give the same file."""
    keys = sorted(word.partition("=")[0].strip() for word in sets)
    digest = hashlib.sha256("\n".join([goal.replace(" ", ""), *keys]).encode()).hexdigest()[:6]
    return Path(f"{locate(case).stem}-{digest}.sweep.json")


def adaptive(
    session: Session, case: str, goal: str, sets: Sequence[str], more: Sequence[str], tolerance: str | None,
    at_once: int | None, most: int | None, out: Path | None, *, new: bool, as_json: bool,
) -> Found:  # fmt: skip
    """Runs the search and prints its result. ``more``: overrides of the case besides the varied key. Raises
    CaseError, ClientError."""
    if not sets:
        raise UsageError("--adaptive needs --set KEY=LOW:HIGH for the key that varies")
    spans, constants = spans_of(sets)
    data = apply_overrides(data_of(case, more), constants)
    path = out or file_of(case, goal, sets)
    if new:
        path.unlink(missing_ok=True)
    try:
        with aloud("submitting the first runs") as name:
            found = found_by(
                session, data, folder_of(case), goal, spans, tolerance, at_once, most or MOST, path, complain, name
            )
    except KeyboardInterrupt:
        complain(f"{path} has the results so far; to continue the search, repeat the command")
        raise
    if as_json:
        echo_json(found)
    else:
        echo("\n".join([*found.lines(), f"kept in {path}"]))
    return found


def finish(found: Found) -> None:
    """Ends the command: exit code 0 if the search has reached the requested width of the bracket, else 1."""
    if not found.reached:
        raise typer.Exit(ExitCode.CRASHED)
