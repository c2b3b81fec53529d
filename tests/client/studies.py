"""A small scaling study of one and two ranks, with numbers whose sums are simple."""

from typing import Any

from conoid.cases.messages import AnyMessage, Counts, Load
from conoid.cases.outcome import Outcome, Sharing
from conoid.client.studies.projection import Network, Projection, project
from conoid.client.studies.study import Study

SLOW = Network(latency=1e-3, bandwidth=1e6)
"""A model network with 1 ms per message and 1 us per byte."""


def load(**fields: Any) -> Load:
    return Load(run="r", imbalance=1.0, **fields)


def counts(shared: int) -> Counts:
    return Counts(run="r", elements=9, nodes=9, shared=shared, fragments=1, elements_per_rank=[])


def two_ranks(digest: str = "abc") -> Projection:
    journal: list[AnyMessage] = [
        counts(10),
        load(
            phases={"elements": [1.0, 2.0], "exchange": [0.5, 0.25], "contact": [0.5, 0.0]}, waiting=[0.5, 0.0],
            steps=3, messages=[2, 4], bytes=[8000, 0], collectives=[3, 3], collective_bytes=[1000, 3000],
        ),
        counts(20),
        load(
            phases={"elements": [2.0, 1.0], "exchange": [0.0, 0.0], "contact": [1.0, 0.0]}, waiting=[0.0, 0.0],
            steps=1, messages=[1, 1], bytes=[0, 3000], collectives=[1, 1], collective_bytes=[0, 0],
        ),
    ]  # fmt: skip
    outcome = Outcome(state="succeeded", ranks=2, steps=4, elapsed=8.0, setup=1.0, rebalances=1, digest=digest)
    return project(journal, outcome, SLOW)


def one_rank() -> Projection:
    alone = load(
        phases={"elements": [5.0], "exchange": [0.0], "contact": [2.0]}, waiting=[0.0], steps=4, messages=[0],
        bytes=[0], collectives=[0], collective_bytes=[0],
    )  # fmt: skip
    return project([counts(0), alone], Outcome(state="succeeded", steps=4, elapsed=9.0, setup=0.0, digest="abc"), SLOW)


def two_threads() -> Projection:
    """Returns the record of a run on one rank with two threads; the second thread has worked for 2 s."""
    alone = load(
        phases={"elements": [2.5], "exchange": [0.0], "contact": [1.5]}, waiting=[0.0], steps=4, messages=[0],
        bytes=[0], collectives=[0], collective_bytes=[0],
    )  # fmt: skip
    outcome = Outcome(
        state="succeeded", steps=4, elapsed=6.0, setup=1.0, digest="abc", threads=2, helped=[2.0],
        serial={"elements": [1.0], "contact": [2.0]}, parallel={"elements": [2.0], "contact": [0.0]},
    )  # fmt: skip
    return project([counts(0), alone], outcome, SLOW)


def by_tasks(threads: int) -> Projection:
    """Returns the record of a run on one rank whose tasks were timed for 1, 2 and 4 threads."""
    seconds = {
        1: {"elements": [6.0], "exchange": [0.0], "contact": [2.0]},
        2: {"elements": [3.0], "exchange": [0.0], "contact": [2.0]},
        4: {"elements": [1.5], "exchange": [0.0], "contact": [2.0]},
    }
    alone = load(
        phases={"elements": [6.0], "contact": [2.0]}, waiting=[0.0], steps=4, messages=[0], bytes=[0], collectives=[0],
        collective_bytes=[0], projected=seconds,
    )  # fmt: skip
    sharing = Sharing(steps=4, regions=40, colours=120, tasks=480, turn=1e-6, call=2e-5, wake=4e-5)
    outcome = Outcome(state="succeeded", steps=4, elapsed=9.0, setup=0.0, digest="abc", threads=4, sharing=sharing)
    return project([counts(0), alone], outcome, SLOW, threads)


def study(*runs: Projection, case: str = "long_rod") -> Study:
    return Study(case, ["run.samples=7"], 2, SLOW, runs)
