"""``mpiexec -n N python -m mpi4py -m conoid.worker CASE --out DIR``: one run, from a case to an outcome."""

import sys

if __name__ == "__main__":
    from .main import main
    from .parallel.mpi import leave

    leave(main(sys.argv[1:]))
