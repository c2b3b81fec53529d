"""The messages of a run: lines of journal.jsonl, and samples on Zenoh and SSE.

The field ``seq`` numbers the messages of a run 1, 2, 3 ... without gaps, so that a reader detects a missing message and
reads it from the journal. Messages are JSON in the journal and on SSE, and MessagePack on Zenoh. A reader ignores
unknown fields of a message.
"""

from typing import ClassVar

import msgspec

from .ledger import Energy as Energy
from .ledger import PartEnergy as PartEnergy

VERSION = 1
"""Version of the format of messages; a reader may refuse messages of other versions."""


class Message(msgspec.Struct, tag_field="type", tag=str.lower, kw_only=True, frozen=True):
    """Base class of all messages, with the common fields. The field ``wall`` is the Unix time in s; ``t`` is the
    simulated time in s.
    """

    channel: ClassVar[str] = "event"
    """Class of the Zenoh key under which the message is published (cases/output/keys.py)."""

    run: str
    seq: int = 0
    wall: float = 0.0
    step: int = 0
    t: float = 0.0
    v: int = VERSION


class Status(Message, frozen=True):
    """Message about a change of the state of the run, or about the present activity (field ``message``)."""

    channel: ClassVar[str] = "state"
    state: str
    cause: str | None = None
    message: str = ""


class Started(Message, frozen=True):
    """Size of the model before the first step. ``setup``: wall time since the start of the worker, s."""

    ranks: int
    elements: int
    nodes: int
    end_time: float
    setup: float
    parts: dict[str, int]
    threads: int = 1
    """Number of tets of each rank."""


class Progress(Message, frozen=True):
    """Message about the progress of the run. ``eta``: estimated remaining wall time, s; ``limiter``: what limits the
    time step.
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
    """Largest energy residual of all history lines so far; some of these lines lie between two messages."""
    sampled: float | None = None
    """Simulated time of the history line from which ``energy``, ``parts`` and ``probes`` are taken, s."""
    probes: dict[str, float | None] = {}
    """Values of the probes by name, in SI units; None for a probe without a value."""


class Load(Message, frozen=True):
    """Load of the ranks since the last Load message: CPU seconds per rank and phase, maximum of the work over its mean,
    and communication. Each list has one number per rank.
    """

    channel: ClassVar[str] = "load"
    phases: dict[str, list[float]]
    imbalance: float
    steps: int = 0
    waiting: list[float] = []
    """CPU seconds of the phase ``exchange`` that are spent in calls that wait for other ranks."""
    messages: list[int] = []
    """Number of point-to-point messages that each rank sends."""
    bytes: list[int] = []
    """Bytes of the point-to-point messages that each rank sends."""
    collectives: list[int] = []
    """Number of collective calls."""
    collective_bytes: list[int] = []
    """Bytes that the rank contributes to collective calls."""
    outside: list[int] = []
    """Number of surface nodes that each rank owns."""
    serial: list[float] = []
    """Wall time in which only one thread of the rank works, s, without waiting for other ranks."""
    parallel: list[float] = []
    """Wall time in parallel regions, whose tasks are divided among the threads of the rank, s."""
    helped: list[float] = []
    """Working time of all threads of the rank except the first, summed, s."""
    threads: int = 1
    """Number of threads of each rank."""
    projected: dict[int, dict[str, list[float]]] = {}
    """Estimated CPU seconds of each phase without waiting, by number of threads."""


class Counts(Message, frozen=True):
    """Message about the present size of the model. ``shared``: number of nodes on more than one rank; ``particles``:
    number of free nodes, without tets.
    """

    channel: ClassVar[str] = "counts"
    elements: int
    nodes: int
    shared: int
    fragments: int
    elements_per_rank: list[int]
    particles: int = 0
    facets: int = 0
    """Number of broken facets."""
    smallest: int = 0
    """Exponent of the first class of the size distribution ``sizes``."""
    sizes: list[int] = []
    """Numbers of fragments by length; class i begins at 2^((smallest + i) / 2) m and ends at the next class. Empty if
    no facet can break."""
    counted: int = -1
    """Step at which ``fragments`` and ``sizes`` were counted: the present step or an earlier step; -1 if unknown."""


class Balance(Message, frozen=True):
    """Message: tets have moved to other ranks in a new decomposition."""

    channel: ClassVar[str] = "load"
    cause: str
    before: dict[str, list[float]]
    """Load before the decomposition, from the last Load message: CPU seconds per step by phase, one number per rank."""
    predicted: list[float]
    """Share of each rank in the quantity that is balanced: CPU seconds per step, outside nodes, or tets."""
    tets: int
    nodes: int
    """Number of tets that have moved to other ranks."""
    cost: float
    """Wall time of the decomposition, s."""
    saved: float
    """Wall time saved by the earlier decompositions, s: estimate with the imbalance before each decomposition, less the
    time used."""


class Groups(Message, frozen=True):
    """Cost of groups of tets since the last Groups message, on any number of ranks. Tets of a group are neighbours at
    the start and stay in the group. In the first message of a worker all loads are 0.
    """

    channel: ClassVar[str] = "load"
    load: list[int]
    """CPU time of each group, ns per step."""
    outside: list[int]
    """Number of surface nodes of each group."""
    rank: int = 0
    """CPU time of a rank without any group, ns per step."""
    centres: list[tuple[float, float, float]] = []
    """Centres of the groups at the start, m. Only the first message contains the centres and the numbers of tets of the
    groups."""
    tets: list[int] = []
    """Number of tets of each group at the start."""
    cost: float = 0.0
    """Assumed cost of a decomposition before the first decomposition, wall time, s."""


class Checkpoint(Message, frozen=True):
    """Message: a complete checkpoint is on disk. ``path`` is relative to the run's folder; ``seconds`` is wall time."""

    path: str
    bytes: int
    seconds: float
    cause: str


class Frame(Message, frozen=True):
    """Message: a frame is on disk. The ``path`` of the frame is relative to the run's folder."""

    index: int
    path: str


class Snapshot(Message, frozen=True):
    """Message: a snapshot of the fragments (cases/output/snapshot.py) is in the run's folder. ``step`` and ``t`` are
    the step and the simulated time of the snapshot.
    """

    channel: ClassVar[str] = "fragments"
    n: int
    path: str
    """Path of the snapshot, relative to the run's folder."""
    bytes: int
    triangles: int
    fragments: int
    sha256: str
    cause: str = ""
    """Reason for which the snapshot was made: ``run.snapshots``, ``asked for``, ``start`` or ``end``."""
    dropped: int = 0
    """Number of scheduled snapshots that were not made since the previous snapshot."""
    smallest: int = 0
    """Exponent of the first class of the size distribution ``sizes``."""
    sizes: list[int] = []
    """Numbers of fragments by length; class i begins at 2^((smallest + i) / 2) m and ends at the next class."""
    tets: int = 0
    """Size of the file with all tets of the snapshot, bytes; 0 without such a file."""
    fields: dict[str, list[float]] = {}
    """Statistics of each field over the triangles: minimum, 0.5 % quantile, 99.5 % quantile, maximum."""


class Fragments(Snapshot, tag="snapshot", kw_only=True, frozen=True):
    """The message about a snapshot together with the snapshot itself, on Zenoh."""

    blob: bytes


class Log(Message, frozen=True):
    """Message: a line of text for the user."""

    channel: ClassVar[str] = "log"
    level: str
    text: str
    rank: int = 0


class Finished(Message, frozen=True):
    """Message: the outcome is on disk. This message is the last message of a worker."""

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
