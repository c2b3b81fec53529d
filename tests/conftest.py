"""Setup of all tests. Numba gets the kernel cache of the worker before any module imports numba, so that kernels are
compiled once and not in every run. Ranks that wait leave their core to other processes, because there may be fewer
cores than ranks. SIGINT is enabled, because a shell without job control that runs the tests in the background would
disable SIGINT for all their processes.
"""

import os
import signal

from conoid.worker.kernels.store import use_cache

use_cache()
os.environ.setdefault("MPIR_CVAR_ENABLE_HEAVY_YIELD", "1")
signal.signal(signal.SIGINT, signal.default_int_handler)
