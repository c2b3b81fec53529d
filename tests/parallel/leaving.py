"""Program under mpiexec: ranks that end at once; the only argument is their exit code."""

import sys

from conoid.worker.parallel.mpi import connect, leave

if __name__ == "__main__":
    connect().share(0)
    leave(int(sys.argv[1]))
