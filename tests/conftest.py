"""Points numba to the worker's kernel cache before anything imports it: compiled once, not once a run."""

from conoid.worker.kernels import use_cache

use_cache()
