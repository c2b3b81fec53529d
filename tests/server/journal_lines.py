"""Messages of a run that computes nothing, as lines of a journal: reports, balance events, snapshots."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from conoid.cases import messages
from conoid.cases.output import layout
from conoid.cases.run import State

ENERGY = {
    "kinetic": 3.0,
    "elastic": 2.0,
    "plastic": 1.0,
    "viscous": 0.0,
    "contact": 0.0,
    "external": 0.0,
    "initial": 6.0,
}


def parts(k: int) -> dict[str, messages.PartEnergy]:
    """Returns energies by part, which only newer versions of the worker report."""
    made = {"rod": (2.0, 0.5 * k), "ball": (1.0, 0.0)}
    return {name: messages.PartEnergy(kinetic=a, internal=b) for name, (a, b) in made.items()} if k else {}


def lines_of_run(reports: int, ranks: int = 2, every: int = 100) -> Iterator[messages.AnyMessage]:
    """Yields the messages of a run with ``reports`` reports. Each group of ``every`` reports is followed by a balance
    event and a snapshot.
    """
    yield messages.Status(run="r", wall=1000.0, state=State.ACCEPTED)
    yield messages.Status(run="r", wall=1010.0, state=State.RUNNING)
    for k in range(reports):
        at: dict[str, Any] = {"run": "r", "step": 10 * k, "t": 1e-9 * k, "wall": 1010.0 + 0.25 * k}
        if k % 3 == 0:
            yield messages.Counts(
                **at, elements=100, nodes=50 + k, shared=4, fragments=1 + k, elements_per_rank=[50, 50], facets=2 * k
            )
        yield messages.Progress(
            **at, end_time=1.0, dt=1e-9 + 1e-15 * k, limiter="stability: tet 1 of rod", eta=1.0,
            energy=messages.Energy(**ENERGY, residual=1e-6 * k), updates_per_second=1e6, parts=parts(k),
        )  # fmt: skip
        phases = {"elements": [3.0] * ranks, "contact": [1.0] * ranks}
        yield messages.Load(**at, phases=phases, imbalance=1.0 + 1e-3 * k, steps=10, waiting=[0.1] * ranks)
        if k % every == every - 1:
            yield messages.Balance(
                **at, cause="time lost", before=phases, predicted=[2.0] * ranks, tets=5, nodes=3, cost=0.1, saved=0.2
            )
            yield snapshot(k // every, f"{k}", **at)


def snapshot(n: int, text: str | bytes, tets: int = 0, **at: Any) -> messages.Snapshot:
    data = text.encode() if isinstance(text, str) else text
    return messages.Snapshot(
        **at, n=n, path=f"snapshots/{n:06d}.snap", bytes=len(data), triangles=4, fragments=7 + n,
        sha256=hashlib.sha256(data).hexdigest(), cause="run.snapshots", tets=tets,
    )  # fmt: skip


def write(folder: Path, lines: Iterator[messages.AnyMessage], after: int = 0) -> int:
    """Appends messages to a journal and writes the files of the snapshots; returns the number of the last message."""
    with (folder / layout.JOURNAL).open("ab" if after else "wb") as file:
        for message in lines:
            after += 1
            line = messages.to_json(message).replace(b'"seq":0', b'"seq":%d' % after)
            file.write(line + b"\n")
    return after
