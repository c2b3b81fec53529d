"""Program under mpiexec: ranks that end at once with the exit code of the only argument."""

import sys

from conoid.worker.parallel.mpi import connect, leave

if __name__ == "__main__":
    connect().share(0)
    leave(int(sys.argv[1]))
