"""Freed memory of the server is used again, by any thread."""

import platform
import subprocess
import sys

import pytest

TURNS = """
import sys, threading
from conoid.server import heap

def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096

def answer(mine, next_):
    mine.wait()
    parts = [bytes(8000) for _ in range(500)]
    pinned.append(parts[-1])
    del parts
    next_.set()
    end.wait()

if sys.argv[1] == "shared":
    assert heap.share()
pinned, end = [], threading.Event()
turns = [threading.Event() for _ in range(9)]
threads = [threading.Thread(target=answer, args=pair) for pair in zip(turns, turns[1:])]
for thread in threads:
    thread.start()
before = resident()
turns[0].set()
turns[-1].wait()
print(resident() - before)
end.set()
"""
"""Program in which eight threads make an answer of 4 MB, one after the other."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has a heap a thread")
def test_threads_that_answer_in_turn_use_the_same_memory() -> None:
    own, shared = (
        int(subprocess.run([sys.executable, "-c", TURNS, how], capture_output=True, text=True, check=True).stdout)
        for how in ("own", "shared")
    )
    assert own > 2 * shared, (own, shared)
