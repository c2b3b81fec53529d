"""Benchmarks of ``make bench``: speed, growth with the mesh, start-up, speed against error, telemetry. The results of
the benchmarks are in docs/performance/bench.md."""

from conoid.worker.kernels.store import use_cache

use_cache()
