"""What ranks count of their messages, against communications of known size; alike under MPI and in threads."""

import json
import pickle
from pathlib import Path

import numpy as np

from conoid.worker.parallel.comm import SerialComm

from ..contact.ranks import on_ranks
from .launching import command, ended
from .sending import talk

RANKS = 3
KNOWN = {
    "exchange": (4, 4 * 5 * 3 * 8, 0, 0),
    "swap": (1, 7 * 8, 1, RANKS * 8),
    "sum": (0, 0, 1, 72),
    "maximum": (0, 0, 1, 16),
    "begin_maximum": (0, 0, 1, 72),
}
"""Messages, their bytes, collectives and what a rank gives to them; nothing is sent to itself, nor an empty message."""
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
