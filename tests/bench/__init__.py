"""``make bench``: speed, growth, start-up, speed against error, telemetry. The figures stand in
docs/performance/bench.md."""

from conoid.worker.kernels.store import use_cache

use_cache()
