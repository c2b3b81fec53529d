"""Under mpiexec: a worker that is told to stop before a step. The arguments: the step, then those of the worker."""

import sys

from conoid.worker import kernels

if __name__ == "__main__":
    kernels.use_cache()
    from conoid.worker.loop import Loop
    from conoid.worker.main import main
    from conoid.worker.parallel.mpi import leave

    last, attend = int(sys.argv[1]), Loop._attend

    def stop_there(loop: Loop) -> None:
        loop._asking._signals.raised |= loop.sim.clock.step + 1 >= last
        attend(loop)

    Loop._attend = stop_there  # type: ignore[method-assign,assignment]
    leave(main(sys.argv[2:]))
