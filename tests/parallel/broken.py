"""Program under mpiexec: a worker in which one rank raises an error in its tenth step. The first argument of the
program is the number of this rank.
"""

import itertools
import sys

from conoid.worker.kernels import store

if __name__ == "__main__":
    store.use_cache()
    from conoid.worker import step
    from conoid.worker.parallel.mpi import connect
    from conoid.worker.run.main import main
    from conoid.worker.simulation import Simulation

    whole, calls = step.second_half, itertools.count(1)

    def second_half(sim: Simulation) -> None:
        if next(calls) == 10:
            raise RuntimeError("the tenth step goes wrong")
        whole(sim)

    if connect().rank == int(sys.argv[1]):
        step.second_half = second_half
    sys.exit(main(sys.argv[2:]))
