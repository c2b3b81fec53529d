"""The digest depends on every bit of the state in the order of the ids, and is the same for any number of ranks."""

import numpy as np
import numpy.typing as npt

from conoid.worker.accounts.digest import digest
from conoid.worker.model.rows import WORK
from conoid.worker.parallel.comm import SerialComm
from conoid.worker.simulation import Simulation

from .kernels import build, run, scene
from .meshes import block


class Strict(SerialComm):
    """Communicator that accepts only types that the interface allows: the type of a maximum is float64. With other
    types MPI would misread the bit patterns."""

    def maximum(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        assert values.dtype == np.float64
        return values.copy()


def moved() -> Simulation:
    sim = build(scene(end=1.0), [block((2, 2, 2), 1e-3)])
    sim.model.nodes.v[:] = np.random.default_rng(1).normal(size=sim.model.nodes.v.shape)
    return run(sim, steps=3)


def test_ranks_reduce_one_type() -> None:
    digest(moved().model, Strict(), [])


def test_equal_runs_have_equal_digests() -> None:
    assert digest(moved().model, SerialComm(), []) == digest(moved().model, SerialComm(), [])


def test_one_bit_changes_the_digest() -> None:
    first = digest(moved().model, SerialComm(), [])
    for change in ("x", "v", "state"):
        model = moved().model
        values = model.blocks[0].state[0, WORK] if change == "state" else getattr(model.nodes, change)[3]
        values[1] = np.nextafter(values[1], np.inf)
        assert digest(model, SerialComm(), []) != first
