"""Start of all tests.

Numba is pointed to the worker's kernel cache before anything imports it: compiled once, not once a run. Ranks that wait
leave their core to others, for there may be fewer cores than ranks. And what tests start can be interrupted: a shell
without job control that runs them in the background has SIGINT ignored by all below.
"""

import os
import signal

from conoid.worker.kernels.store import use_cache

use_cache()
os.environ.setdefault("MPIR_CVAR_ENABLE_HEAVY_YIELD", "1")
signal.signal(signal.SIGINT, signal.default_int_handler)
