"""Messages of invented runs, for tests of the readers of messages."""

from conoid.cases.messages import (
    AnyMessage,
    Counts,
    Energy,
    Finished,
    Frame,
    Load,
    Log,
    Progress,
    Started,
    Status,
)  # fmt: skip

RUN = "r1"
START = 1_000_000.0
END_TIME = 80e-6


def energy(done: float, residual: float = 2e-4) -> Energy:
    """Returns an energy ledger in which the fraction ``done`` of 12 J of kinetic energy has become plastic work."""
    return Energy(
        kinetic=12.0 * (1 - done), elastic=0.0, plastic=12.0 * done, viscous=0.0, contact=0.0, external=0.0,
        initial=12.0, residual=residual,
    )  # fmt: skip


def progress(seq: int, done: float) -> Progress:
    """Returns the progress message of a run at the fraction ``done`` of END_TIME."""
    return Progress(
        run=RUN, seq=seq, wall=START + seq, step=round(1000 * done), t=done * END_TIME, end_time=END_TIME, dt=8.1e-9,
        limiter="tet 7 (bar): sound speed", eta=60 * (1 - done), energy=energy(done), updates_per_second=9.7e6,
    )  # fmt: skip


def status(seq: int, state: str, cause: str | None = None, message: str = "") -> Status:
    """Returns a message with a change of state."""
    return Status(run=RUN, seq=seq, wall=START + seq, state=state, cause=cause, message=message)


def whole() -> list[AnyMessage]:
    """Returns all messages of a run on two ranks, from acceptance to success."""
    story: list[AnyMessage] = [
        status(1, "accepted"), status(2, "queued"), status(3, "starting"), status(4, "running"),
        Started(run=RUN, seq=5, wall=START + 5, ranks=2, elements=24000, nodes=4961, end_time=END_TIME, setup=1.5,
                parts={"bar": 24000}),
        progress(6, 0.25),
        Load(run=RUN, seq=7, wall=START + 7, imbalance=1.2, phases={
            "elements": [1.0, 0.5], "nodes": [0.2, 0.2], "exchange": [0.2, 0.8], "output": [0.1, 0.0]}),
        Counts(run=RUN, seq=8, wall=START + 8, elements=24000, nodes=4961, shared=310, fragments=1, sizes=[1],
               elements_per_rank=[12000, 12000]),
        Frame(run=RUN, seq=9, wall=START + 9, index=0, path="frames/000000.vtkhdf"),
        Log(run=RUN, seq=10, wall=START + 10, level="warning", text="the foot has folded", rank=1),
        progress(11, 0.5), progress(12, 0.75), progress(13, 1.0),
        Finished(run=RUN, seq=14, wall=START + 14, state="succeeded", digest="d" * 64, steps=1000, elapsed=9.0),
        status(15, "succeeded"),
    ]  # fmt: skip
    return story
