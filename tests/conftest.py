"""What all tests begin with.

Numba is pointed to the worker's kernel cache before anything imports it: compiled once, not once a run. And what tests
start can be interrupted: a shell without job control that runs them in the background has SIGINT ignored by all below.
"""

import signal

from conoid.worker.kernels import use_cache

use_cache()
signal.signal(signal.SIGINT, signal.default_int_handler)
