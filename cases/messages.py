"""What a run says while it lives: the lines of journal.jsonl and the samples on Zenoh are these same messages.

Every message is numbered by ``seq`` (1, 2, 3 ... per run, no holes), so a reader sees a gap and refills it from the
journal. JSON in the journal and on SSE, MessagePack on Zenoh. A reader ignores fields that it does not know.
"""

from typing import ClassVar

import msgspec

VERSION = 1
"""Of the format of messages; a reader of another one may refuse them."""


class Message(msgspec.Struct, tag_field="type", tag=str.lower, kw_only=True, frozen=True):
    """The envelope. ``wall`` is Unix time in s, ``t`` simulated time in s."""

    channel: ClassVar[str] = "event"
    """Which class of Zenoh key the message is published under (cases/output/keys.py)."""

    run: str
    seq: int = 0
    wall: float = 0.0
    step: int = 0
    t: float = 0.0
    v: int = VERSION


class Status(Message, frozen=True):
    """The run has changed its state, or ``message`` says what it does in it."""

    channel: ClassVar[str] = "state"
    state: str
    cause: str | None = None
    message: str = ""


class Started(Message, frozen=True):
    """The mesh stands and the first step is about to begin. ``setup`` is s since the worker's start."""

    ranks: int
    elements: int
    nodes: int
    end_time: float
    setup: float
    parts: dict[str, int]
    threads: int = 1
    """Of each rank."""


class Energy(msgspec.Struct, kw_only=True, frozen=True):
    """The ledger, J: what is there and what was lost = initial + external, up to the residual.

    There: kinetic, elastic, cohesive. Lost: plastic, viscous, contact, friction, eroded, fracture,
    stepping. Both: averaging.
    """

    kinetic: float
    elastic: float
    plastic: float
    viscous: float
    contact: float
    """By impulses where bodies meet each other or a wall, without friction."""
    friction: float = 0.0
    eroded: float = 0.0
    """Elastic energy of tets that were taken out, and kinetic energy of nodes that left with them."""
    fracture: float = 0.0
    """By cohesive facets and by tied bonds, for good."""
    cohesive: float = 0.0
    """What the closing of cohesive facets would give back."""
    stepping: float = 0.0
    """By time steps of unequal length, an error of the method; below zero where they have given energy."""
    averaging: float = 0.0
    """By pressures that are averaged over nodes: what their differences store, and what is lost where neighbours yield
    or tear at different times; ``nodal`` and ``split`` alone."""
    external: float
    initial: float
    residual: float
    """|sum of all lines - initial - external| over the largest energy that came in; dimensionless."""


class PartEnergy(msgspec.Struct, kw_only=True, frozen=True):
    """Of one part, J. The sums over all parts are those of the ledger, but for what has left with eroded tets."""

    kinetic: float
    internal: float
    """Work of stress and of bulk viscosity in the tets that are there: elastic, plastic, viscous and averaging."""


class Progress(Message, frozen=True):
    """How far the run is. ``eta`` is wall time left, s; ``limiter`` says what holds the time step down."""

    end_time: float
    dt: float
    limiter: str
    eta: float
    energy: Energy
    updates_per_second: float
    parts: dict[str, PartEnergy] = {}
    """Empty where there is one part alone."""
    worst_residual: float | None = None
    """The largest of any ledger line so far, of which some lie between two messages."""
    sampled: float | None = None
    """Simulated time of the line of the history that has ``energy``, ``parts`` and ``probes``, s."""
    probes: dict[str, float | None] = {}
    """By name, in SI; None where a probe has no value."""


class Load(Message, frozen=True):
    """CPU seconds per rank and phase since the last Load message, max/mean of the work, and what each rank has sent.

    Lists have one number a rank.
    """

    channel: ClassVar[str] = "load"
    phases: dict[str, list[float]]
    imbalance: float
    steps: int = 0
    waiting: list[float] = []
    """Of ``exchange``: CPU seconds in calls that wait for other ranks."""
    messages: list[int] = []
    """To single ranks."""
    bytes: list[int] = []
    """Of these messages."""
    collectives: list[int] = []
    """Calls in which all ranks take part."""
    collective_bytes: list[int] = []
    """That the rank puts into them."""
    outside: list[int] = []
    """Nodes of the surface that each rank owns."""
    serial: list[float] = []
    """Wall time in which one thread of the rank works, s, but for the waiting."""
    parallel: list[float] = []
    """Wall time in regions, whose tasks the threads of the rank share, s."""
    helped: list[float] = []
    """That all threads of the rank but the first have done tasks, together, s."""
    threads: int = 1
    """Of each rank."""
    projected: dict[int, dict[str, list[float]]] = {}
    """By number of threads: the CPU seconds of each phase without the waiting, as they would be with so many."""


class Counts(Message, frozen=True):
    """How large the model is now. ``shared`` is the number of nodes on more than one rank, ``particles`` of those
    that have lost all their tets and fly on."""

    channel: ClassVar[str] = "counts"
    elements: int
    nodes: int
    shared: int
    fragments: int
    elements_per_rank: list[int]
    particles: int = 0
    facets: int = 0
    """That have broken."""
    smallest: int = 0
    """Where ``sizes`` begins."""
    sizes: list[int] = []
    """How many fragments are as long as 2^((smallest + i) / 2) m, and shorter than the next; empty where nothing can
    break."""
    counted: int = -1
    """Step of the state whose ``fragments`` and ``sizes`` these are, the present one or one not long before; -1 where
    that is not known."""


class Balance(Message, frozen=True):
    """Tets have moved to other ranks."""

    channel: ClassVar[str] = "load"
    cause: str
    before: dict[str, list[float]]
    """CPU seconds a step, by phase, one number a rank, over the last Load before."""
    predicted: list[float]
    """What each rank has from now on of what was divided: CPU seconds a step, outside nodes, or tets."""
    tets: int
    nodes: int
    """Moved to other ranks."""
    cost: float
    """Wall time, s."""
    saved: float
    """By the cuts before, s: what steps would have taken with the imbalance from before each, less what they took."""


class Groups(Message, frozen=True):
    """What each of some parts of the mesh costs since the last Groups message, on any number of ranks.

    The parts are neighbours at the start and stay together. The first message of a worker knows no loads: all are 0.
    """

    channel: ClassVar[str] = "load"
    load: list[int]
    """CPU time, ns a step."""
    outside: list[int]
    """Nodes of the surface."""
    rank: int = 0
    """CPU time of a rank whatever it has, ns a step."""
    centres: list[tuple[float, float, float]] = []
    """At the start, m. This and the next in the first message only."""
    tets: list[int] = []
    """At the start."""
    cost: float = 0.0
    """What a cut is taken to cost before there has been one, wall time, s."""


class Checkpoint(Message, frozen=True):
    """The complete state is on disk; ``path`` is relative to the run's folder, ``seconds`` wall time."""

    path: str
    bytes: int
    seconds: float
    cause: str


class Frame(Message, frozen=True):
    """A frame was written; ``path`` is relative to the run's folder."""

    index: int
    path: str


class Snapshot(Message, frozen=True):
    """A snapshot of the fragments (cases/output/snapshot.py) is in the run's folder. ``step`` and ``t`` are its own."""

    channel: ClassVar[str] = "fragments"
    n: int
    path: str
    """Relative to the run's folder."""
    bytes: int
    triangles: int
    fragments: int
    sha256: str
    cause: str = ""
    """``run.snapshots``, ``asked for``, ``start`` or ``end``."""
    dropped: int = 0
    """That were due since the one before and were not made."""
    smallest: int = 0
    """Where ``sizes`` begins."""
    sizes: list[int] = []
    """How many fragments are as long as 2^((smallest + i) / 2) m, and shorter than the next."""
    tets: int = 0
    """Bytes of its file of all tets; 0 where it has none."""
    fields: dict[str, list[float]] = {}
    """Of each field its least value, what 0.5 % and what 99.5 % of the triangles are below, and its largest."""


class Fragments(Snapshot, tag="snapshot", kw_only=True, frozen=True):
    """The same on Zenoh, with the snapshot itself."""

    blob: bytes


class Log(Message, frozen=True):
    """A line for people."""

    channel: ClassVar[str] = "log"
    level: str
    text: str
    rank: int = 0


class Finished(Message, frozen=True):
    """The outcome is on disk. The last message of a worker."""

    state: str
    digest: str
    steps: int
    elapsed: float


AnyMessage = (
    Status | Started | Progress | Load | Balance | Groups | Checkpoint | Counts | Frame | Snapshot | Log | Finished
)

_to_json, _to_msgpack = msgspec.json.Encoder(), msgspec.msgpack.Encoder()
_from_json: msgspec.json.Decoder[AnyMessage] = msgspec.json.Decoder(AnyMessage)
_from_msgpack: msgspec.msgpack.Decoder[AnyMessage] = msgspec.msgpack.Decoder(AnyMessage)
_fragments = msgspec.msgpack.Decoder(Fragments)


def to_json(message: AnyMessage) -> bytes:
    """One journal line, without the line feed."""
    return _to_json.encode(message)


def to_msgpack(message: AnyMessage | Fragments) -> bytes:
    """The payload of a Zenoh sample."""
    return _to_msgpack.encode(message)


def with_blob(message: Snapshot, blob: bytes) -> Fragments:
    """The message of a snapshot with its bytes."""
    return Fragments(**msgspec.structs.asdict(message), blob=blob)


def without_blob(message: Fragments) -> Snapshot:
    """The message alone."""
    return Snapshot(**{name: getattr(message, name) for name in Snapshot.__struct_fields__})


def from_json(line: bytes | str) -> AnyMessage:
    """Raises msgspec.ValidationError for what is not a message, msgspec.DecodeError for what is not JSON."""
    return _from_json.decode(line)


def from_msgpack(payload: bytes) -> AnyMessage:
    """Raises as ``from_json`` does."""
    return _from_msgpack.decode(payload)


def fragments_from_msgpack(payload: bytes) -> Fragments:
    """A sample of the class ``fragments``. Raises as ``from_json`` does."""
    return _fragments.decode(payload)
