"""Under mpiexec: ranks that leave at once with the exit code that is the only argument."""

import sys

from conoid.worker.parallel.mpi import connect, leave

if __name__ == "__main__":
    connect().share(0)
    leave(int(sys.argv[1]))
