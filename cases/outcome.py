"""The outcome file outcome.json. A run writes it last; only this file proves that the run has ended."""

import math
from typing import Any

import msgspec

from .ledger import Energy


class Check(msgspec.Struct, kw_only=True, frozen=True):
    """Result of the comparison with a ``[[reference]]``."""

    name: str
    value: float
    expected: float
    tolerance: float
    passed: bool = msgspec.field(name="pass")
    unit: str = ""
    source: str = ""


class Measured(msgspec.Struct, kw_only=True, frozen=True):
    """Values of a probe: the last value, and the smallest and largest value of all history lines (NaN: unknown)."""

    name: str
    value: float
    unit: str = ""
    least: float = math.nan
    most: float = math.nan


class Made(msgspec.Struct, kw_only=True, frozen=True):
    """The largest energy that a term of the energy ledger has created, divided by the largest energy so far, and the
    simulated time ``time`` at which it was reached, s.
    """

    line: str
    share: float
    time: float


class Compressed(msgspec.Struct, kw_only=True, frozen=True):
    """The largest compression of a part whose material has no law of compressive failure
    (worker/elements/crushing.py).
    """

    part: str
    times: float
    """Compression of the tet divided by the limit of Griffith's criterion (cases/warnings/compression.py)."""
    most: float
    """Largest principal pressure, Pa; negative in tension."""
    least: float
    """Smallest principal pressure, Pa."""
    tets: int
    """Largest number of tets of the part that exceed the criterion in one history line."""
    tet: int
    """Global id of the tet with the largest compression."""
    x: float
    """Position of this tet at the time of the largest compression, m."""
    y: float
    z: float
    time: float
    """Simulated time of the largest compression, s."""


class Sharing(msgspec.Struct, kw_only=True, frozen=True):
    """Measured times of the parallel regions of rank 0 (loops that its threads divide), s, and the costs of dividing
    them that the estimates for other numbers of threads use (worker/parallel/projecting.py).
    """

    steps: int
    regions: int
    colours: int
    tasks: int
    turn: float
    """Cost of one colour of tets in a parallel region."""
    call: float
    """Time that a thread needs to wake a sleeping thread."""
    wake: float
    """Time until a thread that was woken works."""


class Outcome(msgspec.Struct, kw_only=True, frozen=True):
    """The end of a run; times in s, energies in J. A count that is unknown is None, and any other number that is
    unknown is NaN; both are null in the file. The outcome of a run that was lost or never started has only the data
    that its journal contains (server/runs/ends.py).
    """

    state: str
    cause: str | None = None
    message: str = ""
    steps: int | None = None
    time: float = math.nan
    ranks: int = 1
    threads: int = 1
    """Number of threads of each rank."""
    elapsed: float = math.nan
    setup: float = math.nan
    """Wall time from the start of the worker to its first step, s."""
    cpu: float = math.nan
    """CPU time of all ranks and their threads in the loop over the time steps, s; a thread counts only while it works.
    """
    digest: str = ""
    """SHA-256 of the state of all nodes and tets in the order of their global ids. The digest is equal for any number
    of ranks.
    """
    elements: int | None = None
    eroded: int | None = None
    """Number of deleted tets."""
    eroded_mass: float = math.nan
    """Mass of the nodes that were deleted because they had lost all tets, kg."""
    nodes_initial: int | None = None
    nodes: int | None = None
    fragments: int | None = None
    broken: int | None = None
    """Number of broken facets."""
    first_break: float = math.nan
    """Simulated time at which the first facet broke, s; NaN if no facet broke."""
    inside: int | None = None
    """Number of nodes that are inside another body or fragment at the end, deeper than 0.05 of the typical face size. A
    free node also counts if it is inside its own part."""
    deepest: float = math.nan
    """Depth of the deepest node inside another body, divided by the typical face size; nodes that have passed the
    outermost tets do not count."""
    overlapping: int | None = None
    """Number of surface tets with more than a tenth of their volume inside other bodies or fragments at the end."""
    overlap: float = math.nan
    """Volume of surface tets inside other bodies and fragments at the end, divided by the volume of all surface tets.
    """
    rebalances: int | None = None
    balancing_cost: float = math.nan
    """Wall time of all decompositions, s."""
    balancing_saved: float = math.nan
    """Wall time saved by the decompositions, s: estimated time with the imbalance before each decomposition, minus the
    time used."""
    energy: Energy | None = None
    worst_residual: float = math.nan
    """Largest energy residual of all history lines of the run."""
    made: list[Made] = []
    """Energy created by each term of the energy ledger (``run.made_limit``), the largest first. Only terms that have
    created energy are listed."""
    compressed: list[Compressed] = []
    """Largest compression of each part that breaks in tension only and was compressed, the largest first."""
    phases: dict[str, list[float]] = {}
    """CPU time of each phase, s, one number per rank, without the threads of the rank except the first."""
    serial: dict[str, list[float]] = {}
    """Wall time of each phase in which a single thread of the rank works (serial time), s, one number per rank, without
    waiting for other ranks. The serial time limits the gain by more threads. Other programs on the same cores increase
    it."""
    parallel: dict[str, list[float]] = {}
    """Wall time of each phase in parallel regions (loops whose tasks are divided among the threads of a rank), s, one
    number per rank. For a run with one thread, more threads can reduce only this time."""
    projected: dict[int, dict[str, list[float]]] = {}
    """Estimated time of each phase on each rank without waiting, s, by the number of threads; only for a run with this
    option (docs/performance/scaling.md)."""
    sharing: "Sharing | None" = None
    """Measured times of the parallel regions, from which ``projected`` is computed."""
    helped: list[float] = []
    """Sum of the working times of all threads of each rank except the first thread, s; at most (threads - 1) times
    ``parallel``."""
    without: list[str] = []
    """Names of the stages that the case does not have (cases/estimates/stages.py); they cost nothing."""
    peak_memory: list[int] = []
    """Largest resident memory of each rank, bytes."""
    element_updates_per_second: float = math.nan
    """Number of tets times number of steps, per second of CPU time."""
    reference: list[Check] = []
    probes: list[Measured] = []
    """Last, smallest and largest value of each probe, by the name of the probe."""
    warnings: list[str] = []


def known(value: float | None) -> float | None:
    """Returns a number of an outcome, or None if it is unknown."""
    return None if value is None or math.isnan(value) else value


def last_message(outcome: Outcome) -> dict[str, Any]:
    """Returns the fields of the message about the end of the run (messages.Finished) from its outcome; 0 for unknown
    values.
    """
    steps = outcome.steps or 0
    return {
        "step": steps, "t": known(outcome.time) or 0.0, "state": outcome.state, "digest": outcome.digest,
        "steps": steps, "elapsed": known(outcome.elapsed) or 0.0,
    }  # fmt: skip


def to_json(outcome: Outcome) -> bytes:
    """Returns the outcome as indented JSON."""
    return msgspec.json.format(msgspec.json.encode(outcome), indent=2)


def from_json(text: bytes | str) -> Outcome:
    """Reads an outcome. Raises msgspec.ValidationError or msgspec.DecodeError if the text is no outcome. JSON has no
    NaN: NaN is written as null, and null is read as NaN.
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
