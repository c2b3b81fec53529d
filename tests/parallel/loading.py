"""Program under mpiexec: a worker that prints the kernels that it loads after the first step. The arguments of the
program are those of the worker.
"""

import sys

from conoid.worker.kernels import store

if __name__ == "__main__":
    store.use_cache()
    from conoid.worker.kernels.jit import Kernel
    from conoid.worker.parallel.mpi import leave
    from conoid.worker.run.loop import Loop
    from conoid.worker.run.main import main

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
