"""outcome.json: the last file a run writes, and the only proof that it ended."""

import math
from typing import Any

import msgspec

from .messages import Energy


class Check(msgspec.Struct, kw_only=True, frozen=True):
    """One line of ``[[reference]]``, measured."""

    name: str
    value: float
    expected: float
    tolerance: float
    passed: bool = msgspec.field(name="pass")
    unit: str = ""
    source: str = ""


class Measured(msgspec.Struct, kw_only=True, frozen=True):
    """What a probe has measured: at the end, and the extremes of all lines of the history (NaN: not known)."""

    name: str
    value: float
    unit: str = ""
    least: float = math.nan
    most: float = math.nan


class Made(msgspec.Struct, kw_only=True, frozen=True):
    """The most that a line of the ledger has made, a share of the largest energy until then, at ``time``, s."""

    line: str
    share: float
    time: float


class Compressed(msgspec.Struct, kw_only=True, frozen=True):
    """The highest compression in a part without a law of compressive failure (worker/elements/crushing.py)."""

    part: str
    times: float
    """How many times that of Griffith's criterion (compression.py)."""
    most: float
    """The largest pressure on any plane, Pa; tension is below zero."""
    least: float
    """The smallest, Pa."""
    tets: int
    """The most tets of the part that were beyond the criterion at once, of all lines of the history."""
    tet: int
    """The one with the hardest."""
    x: float
    """The place at that time, m."""
    y: float
    z: float
    time: float
    """s."""


class Sharing(msgspec.Struct, kw_only=True, frozen=True):
    """Of what the regions of rank 0 were made, and what it was taken to cost to share them (worker/parallel/
    projecting.py); times in s.
    """

    steps: int
    regions: int
    colours: int
    tasks: int
    turn: float
    """Of a colour."""
    call: float
    """Of a thread that sleeps, by its caller."""
    wake: float
    """Until it works."""


class Outcome(msgspec.Struct, kw_only=True, frozen=True):
    """How a run ended; times in s, energies in J.

    A count that is not known is None, another number NaN: null in the file. A run that was lost, or that never started,
    knows no more than its journal has told (server/runs/ends.py).
    """

    state: str
    cause: str | None = None
    message: str = ""
    steps: int | None = None
    time: float = math.nan
    ranks: int = 1
    threads: int = 1
    """Of each rank."""
    elapsed: float = math.nan
    setup: float = math.nan
    """s from the worker's start to its first step."""
    cpu: float = math.nan
    """CPU s of all ranks and their threads together, in the step loop; of threads, while they work."""
    digest: str = ""
    """sha256 over node and tet state in global-id order: equal for any number of ranks."""
    elements: int | None = None
    eroded: int | None = None
    """Tets that have left."""
    eroded_mass: float = math.nan
    """kg; of nodes that have left with the last of their tets."""
    nodes_initial: int | None = None
    nodes: int | None = None
    fragments: int | None = None
    broken: int | None = None
    """Facets that have broken."""
    inside: int | None = None
    """Nodes that end inside of another body or fragment or, without tets, of their own part, deeper than 0.05 of the
    typical size of a face."""
    deepest: float = math.nan
    """How deep the deepest of them is that has not gone through the outermost tets, in typical sizes of a face."""
    overlapping: int | None = None
    """Tets at surfaces that end with more than a tenth of their volume in other bodies or fragments."""
    overlap: float = math.nan
    """What these bodies and fragments have in common, of the volume of all tets at surfaces."""
    rebalances: int | None = None
    balancing_cost: float = math.nan
    """s; of all cuts."""
    balancing_saved: float = math.nan
    """s: what steps would have taken with the imbalance from before each cut, less what they took."""
    energy: Energy | None = None
    worst_residual: float = math.nan
    """The largest energy residual of any ledger line of the run."""
    made: list[Made] = []
    """What lines of the ledger have made (``run.made_limit``), the worst first; none that has made nothing."""
    compressed: list[Compressed] = []
    """Of each part that breaks in tension alone and has been under compression, the hardest first."""
    phases: dict[str, list[float]] = {}
    """CPU seconds per phase, one number a rank; of its first thread."""
    serial: dict[str, list[float]] = {}
    """Of the wall time of each phase, s, one number a rank: what one thread of the rank did alone, but for the waiting
    for other ranks. It limits what more threads can gain. Other programs on the same cores make it larger."""
    parallel: dict[str, list[float]] = {}
    """The rest of it: in regions, whose tasks the threads of a rank share; with one thread, what more could share."""
    projected: dict[int, dict[str, list[float]]] = {}
    """By number of threads: seconds per phase, without the waiting, that each rank would take with so many threads; of
    a run that was asked for it (docs/performance/scaling.md)."""
    sharing: "Sharing | None" = None
    """Of what these follow."""
    helped: list[float] = []
    """s that all threads of a rank but its first have done tasks, together; at most threads - 1 times ``parallel``."""
    without: list[str] = []
    """Stages that the case does not have (cases/estimates/stages.py): none of its phases has computed them."""
    peak_memory: list[int] = []
    """Largest resident memory, bytes, one number a rank."""
    element_updates_per_second: float = math.nan
    """Per CPU-second and core."""
    reference: list[Check] = []
    probes: list[Measured] = []
    """The last value of each probe, the smallest and the largest."""
    warnings: list[str] = []


def known(value: float | None) -> float | None:
    """A number of an outcome; None where it is not known."""
    return None if value is None or math.isnan(value) else value


def last_message(outcome: Outcome) -> dict[str, Any]:
    """The fields of the message that tells of the outcome (messages.Finished): 0 for what is not known."""
    steps = outcome.steps or 0
    return {
        "step": steps, "t": known(outcome.time) or 0.0, "state": outcome.state, "digest": outcome.digest,
        "steps": steps, "elapsed": known(outcome.elapsed) or 0.0,
    }  # fmt: skip


def to_json(outcome: Outcome) -> bytes:
    """Indented, for people too."""
    return msgspec.json.format(msgspec.json.encode(outcome), indent=2)


def from_json(text: bytes | str) -> Outcome:
    """Raises msgspec.ValidationError or msgspec.DecodeError.

    JSON has no NaN: a number that was none was written as null, and is read back as NaN.
    """
    data = msgspec.json.decode(text)
    if isinstance(data, dict):
        checks, probes = data.get("reference"), data.get("probes")
        _null_to_nan(Outcome, data)
        _null_to_nan(Energy, data.get("energy"))
        for check in checks if isinstance(checks, list) else ():
            _null_to_nan(Check, check)
        for probe in probes if isinstance(probes, list) else ():
            _null_to_nan(Measured, probe)
    return msgspec.convert(data, Outcome, str_keys=True)


def _null_to_nan(kind: type[msgspec.Struct], table: Any) -> None:
    if isinstance(table, dict):
        numbers = {field.encode_name for field in msgspec.structs.fields(kind) if field.type is float}
        table.update({name: math.nan for name in numbers if table.get(name, 0.0) is None})
