"""The outcome file outcome.json: the last file that a run writes, and the only proof of the end of the run."""

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
    """Values of a probe: the last value, and the extremes over all lines of the history (NaN: unknown)."""

    name: str
    value: float
    unit: str = ""
    least: float = math.nan
    most: float = math.nan


class Made(msgspec.Struct, kw_only=True, frozen=True):
    """The largest energy that a term of the energy ledger has created, divided by the largest energy until then, at
    ``time``, s.
    """

    line: str
    share: float
    time: float


class Compressed(msgspec.Struct, kw_only=True, frozen=True):
    """The largest compression of a part without a law of compressive failure (worker/elements/crushing.py)."""

    part: str
    times: float
    """Compression divided by the limit of Griffith's criterion (cases/warnings/compression.py)."""
    most: float
    """Largest principal pressure, Pa; negative in tension."""
    least: float
    """Smallest principal pressure, Pa."""
    tets: int
    """Largest number of tets of the part that are beyond the criterion at the same time, of all history lines."""
    tet: int
    """The tet with the largest compression."""
    x: float
    """Position of the tet at the time of the largest compression, m."""
    y: float
    z: float
    time: float
    """Simulated time of the largest compression, s."""


class Sharing(msgspec.Struct, kw_only=True, frozen=True):
    """Statistics of the parallel regions of rank 0, and the assumed cost of dividing them among threads
    (worker/parallel/projecting.py); times in s.
    """

    steps: int
    regions: int
    colours: int
    tasks: int
    turn: float
    """Cost of one colour of a parallel region."""
    call: float
    """Cost of waking a sleeping thread, for the calling thread."""
    wake: float
    """Time until a woken thread works."""


class Outcome(msgspec.Struct, kw_only=True, frozen=True):
    """The end of a run; times in s, energies in J. An unknown count is None and any other unknown number is NaN; both
    are null in the file. The outcome of a run that was lost, or that never started, has only data of its journal
    (server/runs/ends.py).
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
    """CPU time of all ranks and their threads in the step loop, s; threads count only while they work."""
    digest: str = ""
    """SHA-256 of the state of nodes and tets in the order of global ids; the hash is equal for any number of ranks."""
    elements: int | None = None
    eroded: int | None = None
    """Number of deleted tets."""
    eroded_mass: float = math.nan
    """Mass of nodes that were deleted with the last of their tets, kg."""
    nodes_initial: int | None = None
    nodes: int | None = None
    fragments: int | None = None
    broken: int | None = None
    """Number of broken facets."""
    first_break: float = math.nan
    """Simulated time at which the first facet broke, s; NaN if no facet broke."""
    inside: int | None = None
    """Number of nodes that end inside another body or fragment, deeper than 0.05 of the typical face size; free nodes
    count also inside of their own part."""
    deepest: float = math.nan
    """Depth of the deepest penetrating node that has not passed the outermost tets, divided by the typical face
    size."""
    overlapping: int | None = None
    """Number of surface tets that end with more than a tenth of their volume in other bodies or fragments."""
    overlap: float = math.nan
    """Common volume of penetrating bodies and fragments divided by the volume of all surface tets."""
    rebalances: int | None = None
    balancing_cost: float = math.nan
    """Wall time of all decompositions, s."""
    balancing_saved: float = math.nan
    """Wall time saved by the decompositions, s: estimate with the imbalance before each decomposition, less the time
    used."""
    energy: Energy | None = None
    worst_residual: float = math.nan
    """Largest energy residual of all history lines of the run."""
    made: list[Made] = []
    """Energy created by terms of the energy ledger (``run.made_limit``), the largest first; only terms that have
    created energy."""
    compressed: list[Compressed] = []
    """Largest compression of each part that breaks in tension only and was compressed; the part with the largest value
    comes first."""
    phases: dict[str, list[float]] = {}
    """CPU seconds per phase, one number per rank; only the first thread of the rank counts."""
    serial: dict[str, list[float]] = {}
    """Serial wall time of each phase, s, one number per rank: work of a single thread of the rank, without waiting for
    other ranks. The serial wall time limits the gain of more threads. Other programs on the same cores increase the
    serial wall time."""
    parallel: dict[str, list[float]] = {}
    """Wall time of each phase in parallel regions, whose tasks are divided among the threads of a rank, s. With one
    thread, this is the time that more threads could share."""
    projected: dict[int, dict[str, list[float]]] = {}
    """Estimated seconds per phase and rank without waiting, by number of threads; only for a run with this option
    (docs/performance/scaling.md)."""
    sharing: "Sharing | None" = None
    """Measured times of parallel regions, from which the estimates for other numbers of threads are computed."""
    helped: list[float] = []
    """Working time of all threads of the rank except the first, summed, s; at most threads - 1 times ``parallel``."""
    without: list[str] = []
    """Stages that the case does not have (cases/estimates/stages.py); no phase has computed these stages."""
    peak_memory: list[int] = []
    """Largest resident memory, bytes, one number per rank."""
    element_updates_per_second: float = math.nan
    """Number of tets times steps, per CPU second and core."""
    reference: list[Check] = []
    probes: list[Measured] = []
    """Last, smallest and largest value of each probe, by the name of the probe."""
    warnings: list[str] = []


def known(value: float | None) -> float | None:
    """A number of an outcome; None if unknown."""
    return None if value is None or math.isnan(value) else value


def last_message(outcome: Outcome) -> dict[str, Any]:
    """Returns the fields of the message about the outcome (messages.Finished); 0 for unknown values."""
    steps = outcome.steps or 0
    return {
        "step": steps, "t": known(outcome.time) or 0.0, "state": outcome.state, "digest": outcome.digest,
        "steps": steps, "elapsed": known(outcome.elapsed) or 0.0,
    }  # fmt: skip


def to_json(outcome: Outcome) -> bytes:
    """Returns the outcome as indented JSON."""
    return msgspec.json.format(msgspec.json.encode(outcome), indent=2)


def from_json(text: bytes | str) -> Outcome:
    """Reads an outcome. Raises msgspec.ValidationError or msgspec.DecodeError if the data is no outcome. JSON has no
    NaN, so that NaN is written as null and null is read as NaN.
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
