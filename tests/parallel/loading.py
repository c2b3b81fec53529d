"""Under mpiexec: a worker that prints what kernels it loads once steps have begun. Arguments: those of the worker."""

import sys

from conoid.worker import kernels

if __name__ == "__main__":
    kernels.use_cache()
    from conoid.worker.jit import Kernel
    from conoid.worker.loop import Loop
    from conoid.worker.main import main
    from conoid.worker.parallel.mpi import leave

    run, load = Loop.run, Kernel.load

    def load_late(kernel: Kernel) -> None:
        if not kernel.overloads:
            print(f"late: {kernel.py_func.__module__}.{kernel.py_func.__name__}", flush=True)
        load(kernel)

    def run_told(loop: Loop) -> None:
        Kernel.load = load_late  # type: ignore[method-assign,assignment]
        run(loop)

    Loop.run = run_told  # type: ignore[method-assign,assignment]
    leave(main(sys.argv[1:]))
