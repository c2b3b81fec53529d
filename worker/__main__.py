"""``mpiexec -n N python -m mpi4py -m conoid.worker CASE --out DIR`` executes one run, from a case to an outcome."""

import sys

if __name__ == "__main__":
    from .parallel.mpi import leave
    from .run.main import main

    leave(main(sys.argv[1:]))
