"""Arrays that grow and are allocated again leave no unused memory in the heap of a rank."""

import platform
import subprocess
import sys

import pytest

GROWING = """
import sys
import numpy as np
from conoid.worker.run import heap

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

if sys.argv[1] == "tidy":
    assert heap.tidy()
before, kept = resident(), []
for n in range(200):
    table = np.ones(heap.LARGE // 8 * (1 + n // 20) + n)
    kept.append(np.ones(1000))
    del table
print(resident() - before)
"""
"""A table of 1 to 10 MB is allocated again 200 times, and after each allocation 8 kB remain in use."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc raises its bound")
def test_a_table_that_grows_leaves_no_holes() -> None:
    plain, tidy = (
        int(subprocess.run([sys.executable, "-c", GROWING, how], capture_output=True, text=True, check=True).stdout)
        for how in ("plain", "tidy")
    )
    assert tidy < 4_000_000 < plain, (plain, tidy)
