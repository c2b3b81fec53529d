"""The messages of a run: the lines of journal.jsonl, which are also published over Zenoh and over SSE (server-sent
events).

The field ``seq`` numbers the messages of a run 1, 2, 3 ... without gaps. A reader that misses a number reads that
message from the journal. Messages are JSON in the journal and over SSE, and MessagePack over Zenoh. A reader ignores
unknown fields of a message.
"""

from typing import ClassVar

import msgspec

from .ledger import Energy as Energy
from .ledger import PartEnergy as PartEnergy

VERSION = 1
"""Version of the message format. A reader may refuse messages of other versions."""


class Message(msgspec.Struct, tag_field="type", tag=str.lower, kw_only=True, frozen=True):
    """Base class of all messages, with the common fields. The field ``wall`` is the Unix time in s; ``t`` is the
    simulated time in s.
    """

    channel: ClassVar[str] = "event"
    """Second last part of the Zenoh key under which the message is published (cases/output/keys.py)."""

    run: str
    seq: int = 0
    wall: float = 0.0
    step: int = 0
    t: float = 0.0
    v: int = VERSION


class Status(Message, frozen=True):
    """Message: the state of the run has changed, or the worker has begun another activity (field ``message``)."""

    channel: ClassVar[str] = "state"
    state: str
    cause: str | None = None
    message: str = ""


class Started(Message, frozen=True):
    """Message: the model is ready for the first time step; its size. ``setup``: wall time since the start of the
    worker, s.
    """

    ranks: int
    elements: int
    nodes: int
    end_time: float
    setup: float
    parts: dict[str, int]
    threads: int = 1
    """Number of threads of each rank."""


class Progress(Message, frozen=True):
    """Message: the progress of the run. ``eta``: estimated remaining wall time, s; ``limiter``: what limits the time
    step.
    """

    end_time: float
    dt: float
    limiter: str
    eta: float
    energy: Energy
    updates_per_second: float
    parts: dict[str, PartEnergy] = {}
    """Energies of each part; empty for a case with a single part."""
    worst_residual: float | None = None
    """Largest energy residual of all history lines so far, including lines between two messages."""
    sampled: float | None = None
    """Simulated time of the history line from which ``energy``, ``parts`` and ``probes`` are taken, s."""
    probes: dict[str, float | None] = {}
    """Value of each probe by its name, in SI units; None for a probe without a value."""


class Load(Message, frozen=True):
    """Message: the load of the ranks since the last Load message: CPU time of each rank in each phase, s; largest work
    of a rank divided by the mean work; and communication. Each list has one number per rank.
    """

    channel: ClassVar[str] = "load"
    phases: dict[str, list[float]]
    imbalance: float
    steps: int = 0
    waiting: list[float] = []
    """CPU time of the phase ``exchange`` in calls that wait for other ranks, s."""
    messages: list[int] = []
    """Number of point-to-point messages that each rank has sent."""
    bytes: list[int] = []
    """Number of bytes that each rank has sent in point-to-point messages."""
    collectives: list[int] = []
    """Number of collective calls of each rank."""
    collective_bytes: list[int] = []
    """Number of bytes that each rank has contributed to collective calls."""
    outside: list[int] = []
    """Number of surface nodes that each rank owns."""
    serial: list[float] = []
    """Wall time in which only one thread of each rank works, s, without waiting for other ranks."""
    parallel: list[float] = []
    """Wall time in parallel regions of each rank (loops whose tasks are divided among its threads), s."""
    helped: list[float] = []
    """Sum of the working times of all threads of each rank except the first thread, s."""
    threads: int = 1
    """Number of threads of each rank."""
    projected: dict[int, dict[str, list[float]]] = {}
    """Estimated CPU time of each phase without waiting, s, by the number of threads."""


class Counts(Message, frozen=True):
    """Message: the present size of the model. ``shared``: number of nodes on more than one rank; ``particles``: number
    of free nodes, without tets.
    """

    channel: ClassVar[str] = "counts"
    elements: int
    nodes: int
    shared: int
    fragments: int
    elements_per_rank: list[int]
    particles: int = 0
    facets: int = 0
    """Number of facets that have broken."""
    smallest: int = 0
    """Exponent that gives the lower bound of the first class of ``sizes``."""
    sizes: list[int] = []
    """Numbers of fragments in classes of length: class i contains lengths from 2^((smallest + i) / 2) m up to the
    beginning of the next class. The list is empty if no facet can break."""
    counted: int = -1
    """Time step at which ``fragments`` and ``sizes`` were counted, the present one or an earlier one; -1 if they were
    never counted."""


class Balance(Message, frozen=True):
    """Message: a new decomposition has moved tets to other ranks."""

    channel: ClassVar[str] = "load"
    cause: str
    before: dict[str, list[float]]
    """CPU time of each phase, s per step, one number per rank, from the last Load message before the decomposition."""
    predicted: list[float]
    """Predicted share of each rank in the balanced quantity: CPU time, s per step; or number of outside nodes; or
    number of tets."""
    tets: int
    nodes: int
    """Numbers of tets and of nodes that have moved to other ranks."""
    cost: float
    """Wall time of the decomposition, s."""
    saved: float
    """Wall time saved by the earlier decompositions, s: estimated time with the imbalance before each decomposition,
    minus the time used."""


class Groups(Message, frozen=True):
    """Message: the cost of groups of tets since the last Groups message. The groups are the same for any number of
    ranks. The tets of a group are neighbours at the start and stay in the group. In the first message of each worker
    process all loads are 0.
    """

    channel: ClassVar[str] = "load"
    load: list[int]
    """CPU time of each group, ns per step."""
    outside: list[int]
    """Number of surface nodes of each group."""
    rank: int = 0
    """CPU time per step of a rank without tets, ns."""
    centres: list[tuple[float, float, float]] = []
    """Centres of the groups at the start, m. Only the first message has the fields ``centres`` and ``tets``."""
    tets: list[int] = []
    """Number of tets of each group at the start."""
    cost: float = 0.0
    """Wall time that a decomposition is assumed to cost before the first decomposition, s."""


class Checkpoint(Message, frozen=True):
    """Message: a complete checkpoint is on disk. ``path`` is relative to the run's folder; ``seconds`` is wall time."""

    path: str
    bytes: int
    seconds: float
    cause: str


class Frame(Message, frozen=True):
    """Message: a frame is on disk. The ``path`` of the frame is relative to the folder of the run."""

    index: int
    path: str


class Snapshot(Message, frozen=True):
    """Message: a snapshot of the fragments (cases/output/snapshot.py) is in the run's folder. ``step`` and ``t`` are
    the step and the simulated time of the snapshot.
    """

    channel: ClassVar[str] = "fragments"
    n: int
    path: str
    """Path of the snapshot, relative to the folder of the run."""
    bytes: int
    triangles: int
    fragments: int
    sha256: str
    cause: str = ""
    """Reason for the snapshot: ``run.snapshots``, ``asked for``, ``start`` or ``end``."""
    dropped: int = 0
    """Number of scheduled snapshots that were skipped since the previous snapshot."""
    smallest: int = 0
    """Exponent that gives the lower bound of the first class of ``sizes``."""
    sizes: list[int] = []
    """Numbers of fragments in classes of length: class i contains lengths from 2^((smallest + i) / 2) m up to the
    beginning of the next class."""
    tets: int = 0
    """Size of the file with all tets at the time of the snapshot, bytes; 0 if the snapshot has no such file."""
    fields: dict[str, list[float]] = {}
    """Minimum, 0.5 % quantile, 99.5 % quantile and maximum of each field over the triangles."""


class Fragments(Snapshot, tag="snapshot", kw_only=True, frozen=True):
    """Message about a snapshot together with the bytes of the snapshot, as published over Zenoh."""

    blob: bytes


class Log(Message, frozen=True):
    """Message: a line of text for the user."""

    channel: ClassVar[str] = "log"
    level: str
    text: str
    rank: int = 0


class Finished(Message, frozen=True):
    """Message: the outcome of the run is on disk. ``Finished`` is the last message of a worker process."""

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
    """Returns a message as a journal line without the line feed."""
    return _to_json.encode(message)


def to_msgpack(message: AnyMessage | Fragments) -> bytes:
    """Returns a message as the payload of a Zenoh sample."""
    return _to_msgpack.encode(message)


def with_blob(message: Snapshot, blob: bytes) -> Fragments:
    """Returns the message about a snapshot with the bytes of the snapshot."""
    return Fragments(**msgspec.structs.asdict(message), blob=blob)


def without_blob(message: Fragments) -> Snapshot:
    """Returns the message about a snapshot without the snapshot."""
    return Snapshot(**{name: getattr(message, name) for name in Snapshot.__struct_fields__})


def from_json(line: bytes | str) -> AnyMessage:
    """Reads a message from a journal line. Raises msgspec.ValidationError for other content, msgspec.DecodeError for
    broken JSON.
    """
    return _from_json.decode(line)


def from_msgpack(payload: bytes) -> AnyMessage:
    """Reads a message from a Zenoh sample. Raises the errors of the function ``from_json``."""
    return _from_msgpack.decode(payload)


def fragments_from_msgpack(payload: bytes) -> Fragments:
    """Reads a message from a Zenoh sample of the class ``fragments``. Raises the errors of the function
    ``from_json``.
    """
    return _fragments.decode(payload)
