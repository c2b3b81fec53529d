"""Counts of the messages of ranks, compared with communications of known size; the counts are equal under MPI and in
threads.
"""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest

from conoid.cases.load import apply_overrides, parse_case, read_data, shipped
from conoid.worker import simulation, step
from conoid.worker.parallel.comm import SerialComm

from ..contact.ranks import ThreadComm, on_ranks
from .launching import command, ended
from .sending import talk

RANKS = 3
KNOWN = {
    "exchange": (4, 4 * 5 * 3 * 8, 0, 0),
    "swap": (1, 7 * 8, 1, RANKS * 8),
    "trade": (1, 3 * 8, 0, 0),
    "sum": (0, 0, 1, 72),
    "maximum": (0, 0, 1, 16),
    "begin_maximum": (0, 0, 1, 72),
    "begin_sum": (0, 0, 1, 72),
}
"""Messages, bytes, collective calls, and bytes given to collective calls of each operation. No rank sends a message to
itself, and only ``trade`` sends an empty message."""
OBJECTS = {"share": (0, 0, 2, len(pickle.dumps(bytes(1000), pickle.HIGHEST_PROTOCOL))), "barrier": (0, 0, 1, 0)}


def test_counts_under_mpi() -> None:
    finished = ended(command(RANKS, module=[str(Path(__file__).with_name("sending.py"))]))
    assert finished.returncode == 0, finished.stderr
    for rank in json.loads(finished.stdout):
        assert {name: tuple(counts.values()) for name, counts in rank} == {**KNOWN, **OBJECTS}


def test_counts_in_threads() -> None:
    for rank in on_ranks(RANKS, talk):
        counted = {name: tuple(counts.values()) for name, counts in rank}
        assert {name: counted[name] for name in KNOWN} == KNOWN


def test_one_rank_sends_nothing() -> None:
    comm = SerialComm()
    comm.swap({0: comm.sum(np.arange(3))})
    comm.share("item")
    assert set(comm.sent.since_last().values()) == {0}


@pytest.mark.parametrize(("form", "words"), [("standard", 3), ("nodal", 5), ("split", 8)])
def test_a_shared_node_costs_these_words_a_step(form: str, words: int) -> None:
    """The two ranks with a common node send the forces (3 words), in the nodal form also the volumes (2), and in the
    split form also the gradients (3). Forces that overflow their quantum are sent again, so that the smallest count of
    some steps is used.
    """
    data = apply_overrides(read_data(shipped()["elastic_bar_wall"]), [f"numerics.pressure={form}", "run.frames=0"])
    case = parse_case(data)

    def run(comm: ThreadComm) -> tuple[int, int]:
        sim = simulation.build(case, Path(), comm)
        shared = sim.shared_nodes()
        step.prepare(sim)
        sent = []
        for _ in range(10):
            comm.sent.since_last()
            step.first_half(sim)
            step.second_half(sim)
            sent.append(comm.sent.since_last()["bytes"])
        return min(sent), shared

    (first, shared), (second, _) = on_ranks(2, run)
    assert shared > 0
    assert first == second == shared * words * 8
