"""Program under mpiexec: a worker that gets a stop request before a given step. Arguments of the program: the step,
then the arguments of the worker.
"""

import sys

from conoid.worker.kernels import store

if __name__ == "__main__":
    store.use_cache()
    from conoid.worker.parallel.mpi import leave
    from conoid.worker.run.loop import Loop
    from conoid.worker.run.main import main

    last, attend = int(sys.argv[1]), Loop._attend

    def stop_there(loop: Loop) -> None:
        loop._requests._signals.raised |= loop.sim.clock.step + 1 >= last
        attend(loop)

    Loop._attend = stop_there  # type: ignore[method-assign,assignment]
    leave(main(sys.argv[2:]))
