"""JSON schemas of events, snapshots and the history of a run."""

from typing import Any

import msgspec

from conoid.cases.messages import Snapshot


class EventPage(msgspec.Struct, kw_only=True):
    """Lines of the journal, the number of the last line, and whether the journal has more lines now."""

    events: list[dict[str, Any]]
    last: int
    more: bool


class Snapshots(msgspec.Struct, kw_only=True):
    """Journal messages about snapshots of the fragments."""

    snapshots: list[Snapshot]


class FragmentCourse(msgspec.Struct, kw_only=True):
    """History of one fragment over the snapshots that contain the fragment. Columns: number and time in s of the
    snapshot, mass in kg, speed in m/s, longest side in m, number of tets.
    """

    n: list[int]
    t: list[float]
    mass: list[float]
    speed: list[float]
    size: list[float]
    tets: list[int]


class History(msgspec.Struct, kw_only=True):
    """History of a run with a limited number of points."""

    last: int
    state: str | None
    elapsed: float
    series: dict[str, Any]
    parts: dict[str, dict[str, list[float | None]]]
    """Energies of each part in J, for each time of the history; empty for a case with one part."""
    sizes: dict[str, Any]
    """Newest size distribution of the fragments."""
    ranks: dict[str, Any]
    balance: list[dict[str, Any]]
    snapshots: list[dict[str, Any]]
    log: list[dict[str, Any]]
    """Messages for the log of the run: log lines, states and checkpoints. Of a long log, only the first and the last
    messages."""
    log_left_out: int
    """Number of log messages that ``log`` leaves out."""
    warnings: list[dict[str, Any]]
    """Warnings and errors of the whole log; a repeated text occurs once."""
